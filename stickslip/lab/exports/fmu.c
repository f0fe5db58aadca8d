/* A structure with friction contacts as an FMU for co-simulation (FMI 2.0), without any library.

   x'' = push + W (forces) - A x - B x', W = M^-1 [1/kg], A = M^-1 K, B = M^-1 C. Between two changes of a
   contact's state all is linear: the motion is a Taylor series of order ORDER, the first root of a polynomial
   says where a contact begins to slip, sticks, opens or closes, and the next series begins there. That is how
   time marching (solver.marching) goes, whose law this is. Dimensions and numbers stand before this text. */

#include <math.h>
#include <stdarg.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#ifdef _WIN32
#define EXPORT __declspec(dllexport)
#else
#define EXPORT __attribute__((visibility("default")))
#endif
#define JOINED_(a, b) a##b
#define JOINED(a, b) JOINED_(a, b)
#ifdef FMI2_FUNCTION_PREFIX
#define F(name) JOINED(FMI2_FUNCTION_PREFIX, name)
#else
#define F(name) name
#endif

enum { ORDER = 8, PARTS = 4, INPUT_ORDER = 3, SERIES = ORDER + 1 };
enum { FRICTION = 0, RUBBING = 1, GAP = 2 };            /* laws */
enum { STICK = 0, OPEN = 2 };                           /* what a contact does; one that slips: +1 or -1 */
enum { OK = 0, WARNING = 1, DISCARD = 2, ERROR = 3 };   /* fmi2Status */
#define NOWHERE 2.0                                     /* no place in a step, which is 0 to 1 */

typedef int Boolean;
typedef unsigned int Reference;
typedef struct {
    void (*log)(void *, const char *, int, const char *, const char *, ...);
    void *allocate, *release, *finished, *environment;
} Callbacks;

typedef struct {
    double parameter[NP], input[ND][INPUT_ORDER + 1];
    double time, x[NX], v[NX], force[NC], load[NC];
    int mode[NC], begun;
} State;

typedef struct {
    State now;
    char name[128];
    Callbacks callbacks;
    double X[SERIES][NX], V[SERIES][NX], force[SERIES][NC], load[SERIES][NC], pressed[SERIES][NC];
    double push[SERIES][NF], input[SERIES][ND];
} Model;

static int failed(Model *m, const char *message) {
    if (m->callbacks.log)
        m->callbacks.log(m->callbacks.environment, m->name, ERROR, "logStatusError", message);
    return ERROR;
}

/* Parameters: frequency, factor of the excitation, then mu, N0 and the amplitude of the load of contacts. */
static double omega(const State *s) { return 6.283185307179586477 * s->parameter[0]; }
static double mu(const State *s, int c) { return s->parameter[2 + 3 * c]; }
static double mean(const State *s, int c) { return s->parameter[3 + 3 * c]; }
static double wave(const State *s, int c, int k) {
    if (k > 0) return WAVE[c][k];
    return s->parameter[4 + 3 * c] * (TIED[c] ? mean(s, c) : 1.0);
}
static double rest(const State *s, int c) { return PRESTRESSED[c] ? fmax(mean(s, c), 0.0) : 0.0; }

static double along(const double row[NX], const double *x) {
    double total = 0.0;
    for (int i = 0; i < NX; i++) total += row[i] * x[i];
    return total;
}

static double value_at(const double *q, double s) {
    double total = 0.0;
    for (int k = ORDER; k >= 0; k--) total = total * s + q[k];
    return total;
}

static double slope_at(const double *q, double s) {
    double total = 0.0;
    for (int k = ORDER; k > 0; k--) total = total * s + k * q[k];
    return total;
}

/* Where q falls, or its slope rises, through 0 between a and b, on the far side of it. */
static double fall(const double *q, int of_slope, double a, double b) {
    for (int i = 0; i < 60 && b - a > 1e-16; i++) {
        double middle = 0.5 * (a + b);
        double f = of_slope ? -slope_at(q, middle) : value_at(q, middle);
        if (f > 0.0) a = middle; else b = middle;
    }
    return b;
}

/* The first place in a step where a polynomial falls below 0. */
static double first_fall(const double *q) {
    double others = 0.0, a = 0.0, before = q[1];
    for (int k = 1; k <= ORDER; k++) others += fabs(q[k]);
    if (q[0] > others) return NOWHERE;
    if (q[0] <= 0.0 && q[1] < 0.0) return 0.0;
    for (int part = 1; part <= PARTS; part++) {
        double b = (double)part / PARTS, slope = slope_at(q, b);
        if (value_at(q, b) < 0.0) return fall(q, 0, a, b);
        if (before < 0.0 && slope > 0.0) {
            double lowest = fall(q, 1, a, b);
            if (value_at(q, lowest) < 0.0) return fall(q, 0, a, lowest);
        }
        a = b, before = slope;
    }
    return NOWHERE;
}

/* Add size cos(order omega t + phase) as a series over a step h from t on. */
static void add_wave(const State *s, double size, int order, double phase, double t, double h, double *to, int stride) {
    double turn = order * omega(s) * h, angle = order * omega(s) * t + phase, power = size;
    for (int k = 0; k <= ORDER; k++) {
        to[k * stride] += power * cos(angle + k * 1.5707963267948966192);
        power *= turn / (k + 1);
    }
}

/* Series of what is given: loads, forces, inputs, which are polynomials in the time since they were set. */
static void given_series(Model *m, double t, double h) {
    State *s = &m->now;
    memset(m->load, 0, sizeof m->load), memset(m->pressed, 0, sizeof m->pressed);
    memset(m->push, 0, sizeof m->push), memset(m->input, 0, sizeof m->input);
    for (int c = 0; c < CONTACTS; c++) {
        m->load[0][c] = mean(s, c), m->pressed[0][c] = -rest(s, c);
        for (int k = 0; k < NW; k++)
            if (wave(s, c, k) != 0.0)
                add_wave(s, wave(s, c, k), k + 1, WAVE_PHASE[c][k], t, h, &m->load[0][c], NC);
    }
    for (int f = 0; f < FORCES; f++)
        add_wave(s, AMPLITUDE[f] * (HARMONIC[f] ? s->parameter[1] : 1.0), HARMONIC[f], PHASE[f], t, h,
                 &m->push[0][f], NF);
    double gone = t - s->time;
    for (int d = 0; d < DOFS; d++)
        for (int k = 0; k <= INPUT_ORDER; k++) { /* a term a (gone + s h)^k / k! */
            for (int j = 0; j <= k; j++) {
                double share = s->input[d][k];
                for (int i = 1; i <= k - j; i++) share *= gone / i;
                for (int i = 1; i <= j; i++) share *= h / i;
                m->input[j][d] += share;
            }
        }
}

/* Coefficient k of the contact forces. */
static void contact_series(Model *m, int k) {
    State *s = &m->now;
    for (int c = 0; c < CONTACTS; c++) {
        int mode = s->mode[c];
        if (LAW[c] == RUBBING) {
            m->load[k][c] += KN[c] * along(NORMAL[c], m->X[k]);
            if (mode != OPEN) m->pressed[k][c] += m->load[k][c];
        }
        if (mode == OPEN || (LAW[c] != GAP && mu(s, c) == 0.0))
            m->force[k][c] = 0.0;
        else if (mode == STICK) {
            m->force[k][c] = KT[c] * along(ALONG[c], m->X[k]);
            if (k == 0) m->force[k][c] = LAW[c] == GAP ? m->force[k][c] - KT[c] * GAPS[c] : s->force[c];
        } else
            m->force[k][c] = mode * mu(s, c) * m->load[k][c];
    }
}

/* The series of motion and forces over a step h from t on. */
static void expand(Model *m, double t, double h) {
    State *s = &m->now;
    memcpy(m->X[0], s->x, sizeof s->x), memcpy(m->V[0], s->v, sizeof s->v);
    given_series(m, t, h);
    contact_series(m, 0);
    for (int k = 0; k < ORDER; k++) {
        for (int i = 0; i < NX; i++) {
            double rise = -along(A[i], m->X[k]) - along(B[i], m->V[k]);
            for (int f = 0; f < FORCES; f++) rise += W_FORCE[f][i] * m->push[k][f];
            if (k <= INPUT_ORDER)
                for (int d = 0; d < DOFS; d++) rise += W_INPUT[d][i] * m->input[k][d];
            for (int c = 0; c < CONTACTS; c++) {
                rise -= W_ALONG[c][i] * m->force[k][c];
                if (PRESSES[c]) rise -= W_NORMAL[c][i] * m->pressed[k][c];
            }
            m->V[k + 1][i] = h / (k + 1) * rise, m->X[k + 1][i] = h / (k + 1) * m->V[k][i];
        }
        contact_series(m, k + 1);
    }
}

static double size_of(Model *m, const double row[NX]) {
    double total = 0.0;
    for (int k = 0; k <= ORDER; k++) total += fabs(along(row, m->X[k]));
    return total;
}

/* Where in the step contact c leaves its state, and the state it goes to. Margins far below the accuracy keep
   rounding from undoing a change just made. */
static double next_change(Model *m, double h, int c, int *target) {
    State *s = &m->now;
    int mode = s->mode[c];
    double q[SERIES], when, margin = fabs(mean(s, c));
    if (LAW[c] == GAP) {
        double sign = mode == OPEN ? -1.0 : 1.0;
        for (int k = 0; k <= ORDER; k++) q[k] = sign * along(ALONG[c], m->X[k]);
        q[0] += 1e-13 * (fabs(GAPS[c]) + size_of(m, ALONG[c])) - sign * GAPS[c];
        *target = mode == OPEN ? STICK : OPEN;
        return first_fall(q);
    }
    for (int k = 0; k < NW; k++) margin += fabs(wave(s, c, k));
    if (LAW[c] == FRICTION && mu(s, c) * margin <= 0.0) return NOWHERE;
    if (LAW[c] == RUBBING) margin += KN[c] * size_of(m, NORMAL[c]);
    margin *= 1e-13;
    for (int k = 0; k <= ORDER; k++) q[k] = mode == OPEN ? -m->load[k][c] : m->load[k][c];
    q[0] += margin;
    when = mode == STICK && mu(s, c) > 0.0 ? NOWHERE : first_fall(q);
    *target = mode == OPEN ? STICK : OPEN;
    if (mode == OPEN || mu(s, c) == 0.0) return when;
    for (int direction = 1; direction >= -1; direction -= 2) {
        if (mode == STICK) { /* the distance to its limit */
            for (int k = 0; k <= ORDER; k++) q[k] = mu(s, c) * m->load[k][c] - direction * m->force[k][c];
        } else if (mode == direction) { /* while positive, it goes on slipping */
            for (int k = 0; k < ORDER; k++)
                q[k] = mode * KT[c] * along(ALONG[c], m->V[k]) - mu(s, c) * (k + 1) * m->load[k + 1][c] / h;
            q[ORDER] = 0.0;
        } else
            continue;
        q[0] += mu(s, c) * margin;
        double where = first_fall(q);
        if (where <= when) when = where, *target = mode == STICK ? direction : STICK;
    }
    return when;
}

/* Put contact c into its next state at t; one that closes sticks or slips by its rates. */
static void change(State *s, double t, int c, int target) {
    int closes = s->mode[c] == OPEN;
    s->mode[c] = target;
    if (target != OPEN && !closes) return;
    s->force[c] = 0.0;
    if (target == OPEN || LAW[c] == GAP || mu(s, c) == 0.0) return;
    double pull = KT[c] * along(ALONG[c], s->v), rise = LAW[c] == RUBBING ? KN[c] * along(NORMAL[c], s->v) : 0.0;
    for (int k = 0; k < NW; k++) {
        double turn = (k + 1) * omega(s);
        rise -= turn * wave(s, c, k) * sin(turn * t + WAVE_PHASE[c][k]);
    }
    if (fabs(pull) > mu(s, c) * rise) s->mode[c] = pull > 0.0 ? 1 : -1;
}

/* Go over one step, cut at every change of state. */
static int step(Model *m, double t, double h) {
    State *s = &m->now;
    double gone = 0.0;
    for (int small = 0; h - gone > 0.0;) {
        double left = h - gone, end = 1.0;
        int which = -1, target = STICK, next;
        expand(m, t + gone, left);
        for (int c = 0; c < CONTACTS; c++) {
            double when = next_change(m, left, c, &next);
            if (when <= 1.0 && (which < 0 || when < end)) end = when, which = c, target = next;
        }
        for (int i = 0; i < NX; i++) {
            double x = 0.0, v = 0.0;
            for (int k = ORDER; k >= 0; k--) x = x * end + m->X[k][i], v = v * end + m->V[k][i];
            s->x[i] = x, s->v[i] = v;
        }
        for (int c = 0; c < CONTACTS; c++) {
            double force = 0.0, load = 0.0;
            for (int k = ORDER; k >= 0; k--) force = force * end + m->force[k][c], load = load * end + m->load[k][c];
            s->force[c] = force, s->load[c] = LAW[c] == GAP ? fmax(force, 0.0) : fmax(load, 0.0);
        }
        if (which < 0) return OK;
        gone += end * left;
        change(s, t + gone, which, target);
        small = omega(s) * end * left < 1e-12 ? small + 1 : 0;
        if (small > 20 + 8 * CONTACTS) return failed(m, "a contact changes its state without end at one instant");
    }
    return OK;
}

/* The state at rest, contacts without force. */
static void begin(Model *m) {
    State *s = &m->now;
    memset(s->x, 0, sizeof s->x), memset(s->v, 0, sizeof s->v), memset(s->force, 0, sizeof s->force);
    for (int c = 0; c < CONTACTS; c++) {
        double load = mean(s, c);
        for (int k = 0; k < NW; k++) load += wave(s, c, k) * cos((k + 1) * omega(s) * s->time + WAVE_PHASE[c][k]);
        if (LAW[c] == GAP) load = -GAPS[c];
        s->mode[c] = (LAW[c] == FRICTION ? mu(s, c) * load : load) > 0.0 ? STICK : OPEN;
        if (LAW[c] == GAP) load *= KT[c], s->force[c] = fmax(load, 0.0);
        s->load[c] = fmax(load, 0.0);
    }
    s->begun = 1;
}

/* The functions of FMI 2.0. */

EXPORT const char *F(fmi2GetTypesPlatform)(void) { return "default"; }
EXPORT const char *F(fmi2GetVersion)(void) { return "2.0"; }
EXPORT int F(fmi2SetDebugLogging)(void *c, Boolean on, size_t n, const char *const *categories) {
    return (void)c, (void)on, (void)n, (void)categories, OK;
}

EXPORT void *F(fmi2Instantiate)(const char *name, int type, const char *guid, const char *resources,
                                const Callbacks *callbacks, Boolean visible, Boolean logging) {
    (void)resources, (void)visible, (void)logging;
    if (type != 1 || !guid || strcmp(guid, GUID) != 0) return NULL;
    Model *m = calloc(1, sizeof *m);
    if (!m) return NULL;
    snprintf(m->name, sizeof m->name, "%s", name ? name : "");
    if (callbacks) m->callbacks = *callbacks;
    memcpy(m->now.parameter, PARAMETER, sizeof PARAMETER);
    return m;
}
EXPORT void F(fmi2FreeInstance)(void *c) { free(c); }
EXPORT int F(fmi2SetupExperiment)(void *c, Boolean tolerant, double tolerance, double start, Boolean ends, double stop) {
    (void)tolerant, (void)tolerance, (void)ends, (void)stop;
    ((Model *)c)->now.time = start;
    return OK;
}
EXPORT int F(fmi2EnterInitializationMode)(void *c) { return (void)c, OK; }
EXPORT int F(fmi2ExitInitializationMode)(void *c) { return begin(c), OK; }
EXPORT int F(fmi2Terminate)(void *c) { return (void)c, OK; }
EXPORT int F(fmi2Reset)(void *c) {
    memset(&((Model *)c)->now, 0, sizeof(State));
    memcpy(((Model *)c)->now.parameter, PARAMETER, sizeof PARAMETER);
    return OK;
}

/* References: parameters, inputs, then displacements and velocities of DOFs, friction and load of contacts, and
   the observed motion. */
EXPORT int F(fmi2GetReal)(void *c, const Reference *r, size_t n, double *values) {
    Model *m = c;
    State *s = &m->now;
    if (!s->begun) begin(m), s->begun = 0;
    for (size_t i = 0; i < n; i++) {
        Reference k = r[i];
        if (k < PARAMETERS) values[i] = s->parameter[k];
        else if ((k -= PARAMETERS) < DOFS) values[i] = s->input[k][0];
        else if ((k -= DOFS) < DOFS) values[i] = along(SHAPES[k], s->x);
        else if ((k -= DOFS) < DOFS) values[i] = along(SHAPES[k], s->v);
        else if ((k -= DOFS) < CONTACTS) values[i] = s->force[k];
        else if ((k -= CONTACTS) < CONTACTS) values[i] = s->load[k];
        else if ((k -= CONTACTS) == 0) values[i] = along(OBSERVE, s->x);
        else return failed(m, "fmi2GetReal: there is no such value reference");
    }
    return OK;
}
EXPORT int F(fmi2SetReal)(void *c, const Reference *r, size_t n, const double *values) {
    Model *m = c;
    for (size_t i = 0; i < n; i++) {
        if (!isfinite(values[i])) return failed(m, "fmi2SetReal: values must be finite");
        if (r[i] < PARAMETERS) {
            if (m->now.begun) return failed(m, "fmi2SetReal: parameters are set before the initialization ends");
            m->now.parameter[r[i]] = values[i];
        } else if (r[i] < PARAMETERS + DOFS) {
            memset(m->now.input[r[i] - PARAMETERS], 0, sizeof m->now.input[0]);
            m->now.input[r[i] - PARAMETERS][0] = values[i];
        } else
            return failed(m, "fmi2SetReal: only parameters and inputs can be set");
    }
    return OK;
}
EXPORT int F(fmi2SetRealInputDerivatives)(void *c, const Reference *r, size_t n, const int *order, const double *values) {
    for (size_t i = 0; i < n; i++) {
        if (r[i] < PARAMETERS || r[i] >= PARAMETERS + DOFS || order[i] < 1)
            return failed(c, "fmi2SetRealInputDerivatives: there is no such input");
        if (order[i] <= INPUT_ORDER) ((Model *)c)->now.input[r[i] - PARAMETERS][order[i]] = values[i];
    }
    return OK;
}
EXPORT int F(fmi2DoStep)(void *c, double t, double length, Boolean keep) {
    Model *m = c;
    (void)keep;
    m->now.time = t;
    double rate = fmax(RATE, 2.0 * HIGHEST * omega(&m->now));
    double count = fmax(1.0, ceil(length * rate / STEP));
    if (!(length >= 0.0) || !(count < 1e9)) return failed(m, "fmi2DoStep: the step must be 0 s or more, and not too long");
    for (double k = 0.0; k < count && length > 0.0; k++)
        if (step(m, t + k / count * length, length / count) != OK) return ERROR;
    for (int d = 0; d < DOFS; d++) /* derivatives are those of one step */
        memset(m->now.input[d] + 1, 0, INPUT_ORDER * sizeof(double));
    m->now.time = t + length;
    for (int i = 0; i < NX; i++)
        if (!isfinite(m->now.x[i] + m->now.v[i])) return failed(m, "the motion grows without bound");
    return OK;
}
EXPORT int F(fmi2GetFMUstate)(void *c, void **state) {
    if (!*state && !(*state = malloc(sizeof(State)))) return ERROR;
    memcpy(*state, &((Model *)c)->now, sizeof(State));
    return OK;
}
EXPORT int F(fmi2SetFMUstate)(void *c, void *state) { return memcpy(&((Model *)c)->now, state, sizeof(State)), OK; }
EXPORT int F(fmi2FreeFMUstate)(void *c, void **state) { return (void)c, free(*state), *state = NULL, OK; }
EXPORT int F(fmi2SerializedFMUstateSize)(void *c, void *state, size_t *size) {
    return (void)c, (void)state, *size = sizeof(State), OK;
}
EXPORT int F(fmi2SerializeFMUstate)(void *c, void *state, char *bytes, size_t size) {
    return (void)c, size < sizeof(State) ? ERROR : (memcpy(bytes, state, sizeof(State)), OK);
}
EXPORT int F(fmi2DeSerializeFMUstate)(void *c, const char *bytes, size_t size, void **state) {
    (void)c;
    if (size != sizeof(State) || !(*state = malloc(size))) return ERROR;
    return memcpy(*state, bytes, size), OK;
}

/* What this has nothing of. */
EXPORT int F(fmi2GetInteger)(void *c, const Reference *r, size_t n, int *v) { return (void)c, (void)r, (void)v, n ? ERROR : OK; }
EXPORT int F(fmi2GetBoolean)(void *c, const Reference *r, size_t n, Boolean *v) { return (void)c, (void)r, (void)v, n ? ERROR : OK; }
EXPORT int F(fmi2GetString)(void *c, const Reference *r, size_t n, const char **v) { return (void)c, (void)r, (void)v, n ? ERROR : OK; }
EXPORT int F(fmi2SetInteger)(void *c, const Reference *r, size_t n, const int *v) { return (void)c, (void)r, (void)v, n ? ERROR : OK; }
EXPORT int F(fmi2SetBoolean)(void *c, const Reference *r, size_t n, const Boolean *v) { return (void)c, (void)r, (void)v, n ? ERROR : OK; }
EXPORT int F(fmi2SetString)(void *c, const Reference *r, size_t n, const char *const *v) { return (void)c, (void)r, (void)v, n ? ERROR : OK; }
EXPORT int F(fmi2GetDirectionalDerivative)(void *c, const Reference *u, size_t n, const Reference *k, size_t l, const double *d, double *v) {
    return (void)c, (void)u, (void)n, (void)k, (void)l, (void)d, (void)v, ERROR;
}
EXPORT int F(fmi2GetRealOutputDerivatives)(void *c, const Reference *r, size_t n, const int *o, double *v) {
    return (void)c, (void)r, (void)o, (void)v, n ? ERROR : OK;
}
EXPORT int F(fmi2CancelStep)(void *c) { return (void)c, ERROR; }
EXPORT int F(fmi2GetStatus)(void *c, int kind, int *v) { return (void)c, (void)kind, (void)v, DISCARD; }
EXPORT int F(fmi2GetRealStatus)(void *c, int kind, double *v) { return (void)kind, *v = ((Model *)c)->now.time, OK; }
EXPORT int F(fmi2GetIntegerStatus)(void *c, int kind, int *v) { return (void)c, (void)kind, (void)v, DISCARD; }
EXPORT int F(fmi2GetBooleanStatus)(void *c, int kind, Boolean *v) { return (void)c, (void)kind, *v = 0, OK; }
EXPORT int F(fmi2GetStringStatus)(void *c, int kind, const char **v) { return (void)c, (void)kind, (void)v, DISCARD; }
