// The views of the page in the order of their cards: a further one is its file and a line here. Those of the lab stand
// in its folders (`view.js`). Every kind the service knows is a question in a card, that of one
// without a view of its own shows its result too.

import { identify } from "./identify/view.js";
import { LAB } from "./lab.js";
import { modes } from "./modes/view.js";
import { campbell } from "./views/campbell.js";
import { design } from "./views/design.js";
import { front } from "./views/front.js";
import { interference } from "./views/interference.js";
import { map } from "./views/map.js";
import { margin } from "./views/margin.js";
import { point, timeMarch } from "./views/point.js";
import { problem } from "./views/problem.js";
import { response } from "./views/response.js";

export const VIEWS = [response, problem, design, map, front, margin, ...LAB, campbell, interference, point, timeMarch, modes, identify];

// The tabs that cards stand under; all of them stand under the last.
export const TABS = [["response", "Response"], ["design", "Design"], ["disk", "Disk"], ["modes", "Modes"], ["identify", "Identification"], ["studies", "Studies"], ["map", "Map"], ["accuracy", "Accuracy"], ["runs", "Runs"], ["all", "All"]];

// Those that show a kind of job in a card of their own.
export const STUDIES = VIEWS.filter(({ kind, title }) => kind && title);
export const viewOf = (kind) => VIEWS.find((view) => view.kind === kind);

// Whether a kind is shown elsewhere than among the other studies.
export const hasOwnView = (kind) => Boolean(viewOf(kind) && !viewOf(kind).drawings);
