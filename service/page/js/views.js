// The kinds of job with a view of their own: a further one is its module and a line here. The card "Other
// studies" has a form and a view for every other kind the service knows.

import { designView } from "./design.js";
import { frontView } from "./front.js";
import { mapView } from "./map.js";
import { sweepView } from "./response.js";
import { accuracyView, campbellView } from "./studies.js";

export const VIEWS = {
  sweep: sweepView,
  design: designView,
  map: mapView,
  pareto: frontView,
  accuracy: accuracyView,
  campbell: campbellView,
  march: null, // Follows the point that is looked at, which begins it.
};
