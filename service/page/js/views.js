// The kinds of job with a view of their own: a further one is its module and a line here. The card "Other
// studies" has a form and a view for every other kind the service knows.

import { interferenceView } from "./disk/interference.js";
import { designView } from "./views/design.js";
import { frontView } from "./views/front.js";
import { identifyView } from "./identify/view.js";
import { mapView } from "./views/map.js";
import { modesView } from "./modes/view.js";
import { sweepView } from "./views/response.js";
import { accuracyView, campbellView } from "./views/studies.js";

export const VIEWS = {
  sweep: sweepView,
  design: designView,
  map: mapView,
  pareto: frontView,
  accuracy: accuracyView,
  campbell: campbellView,
  modes: modesView,
  identify: identifyView,
  interference: interferenceView,
  march: null, // Follows the point that is looked at, which begins it.
};
