// Light, dark, or as the system has it; kept on this machine.

import { byId } from "./dom.js";
import { tell } from "./events.js";

const KEPT = "stickslip-theme";

export function startTheme() {
  const choose = byId("theme");
  choose.value = localStorage.getItem(KEPT) ?? "";
  apply(choose.value);
  choose.addEventListener("change", () => {
    if (choose.value) localStorage.setItem(KEPT, choose.value);
    else localStorage.removeItem(KEPT);
    apply(choose.value);
  });
}

function apply(theme) {
  if (theme) document.documentElement.dataset.theme = theme;
  else delete document.documentElement.dataset.theme;
  tell("theme", theme);
}
