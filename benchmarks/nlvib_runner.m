% One nonlinear mode by NLvib under Octave, in a process of its own: octave-cli nlvib_runner.m FOLDER TASK ANSWER.
% FOLDER is NLvib's; TASK and ANSWER are files of JSON.
given = argv();
addpath(fullfile(given{1}, "SRC"), fullfile(given{1}, "SRC", "MechanicalSystems"));
warning("off", "all");
task = jsondecode(fileread(given{2}));
n = rows(task.M);
elements = cell(1, numel(task.sliders));
for i = 1:numel(task.sliders)
  direction = zeros(n, 1);
  direction(task.sliders(i) + 1) = 1;
  elements{i} = struct("type", "elasticDryFriction", "stiffness", task.kt, "friction_limit_force", task.limit, ...
                       "ishysteretic", true, "force_direction", direction);
end
structure = MechanicalSystem(task.M, task.C, task.K, elements);
H = task.harmonics;
start = [zeros((2 * H + 1) * n, 1); task.omega; task.zeta];
start(n + (1:n)) = task.shape;
% The coordinate whose velocity is zero at first: the one that moves most.
[~, fixed] = max(abs(task.shape));
scale = mean(abs(task.K * task.shape(:)));
residual = @(X) HB_residual(X, structure, H, task.samples, "nma", fixed, scale);
% Its own scales and least step serve best.
options = struct("dsmax", task.step, "stepmax", 4000);
% As NLvib's own, which Octave does not read.
solving = optimset("Display", "off", "Jacobian", "on", "MaxIter", 50);
clock = tic();
processor = cputime();
% What it tells while it goes is of no use here.
said = evalc("X = solve_and_continue(start, residual, task.log10(1), task.log10(2), task.step, options, {}, solving);");
processor = cputime() - processor;
answer = struct("seconds", toc(clock), "cpu_seconds", processor, "amplitude", 10 .^ X(end, :), ...
                "omega", X(end - 2, :), "zeta", X(end - 1, :));
file = fopen(given{3}, "w");
fputs(file, jsonencode(answer));
fclose(file);
