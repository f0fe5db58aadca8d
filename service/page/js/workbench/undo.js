// What is deleted goes to the bin of the service, and comes back on a click.

import { request } from "../network/api.js";
import { byId, el, show } from "../base/dom.js";
import { tell } from "../base/events.js";

// Puts what has an address in the bin and offers to take it out: `after(true)` once it is gone, `after(false)` once it is back.
export async function undoable(words, path, after) {
  try {
    await request(path, { method: "DELETE" });
    await after(true);
  } catch (error) {
    return tell("notice", error.message);
  }
  const host = byId("undo");
  const back = el("button", { type: "button", onclick: async () => {
    try {
      await request(`${path}/restore`, { method: "POST" });
      show(host);
      await after(false);
    } catch (error) {
      tell("notice", error.message);
    }
  } }, "Undo");
  show(host, el("span", {}, words), " ", back);
  back.focus();
  return undefined;
}
