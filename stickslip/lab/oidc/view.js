// Logging in with the organisation's account: the way there, and the key that waits on the way back.

import { byId, el, show } from "../base/dom.js";
import { on, tell } from "../base/state.js";
import { post, request, setKey } from "../network/api.js";
import { view as viewOf } from "../views/view.js";

const REFUSED = {
  expired: "The log-in took too long: begin again.",
  refused: "The log-in was refused where your organisation's accounts are.",
  "not-allowed": "Your account may not use this service: ask who runs it.",
  unreachable: "Where your organisation's accounts are, nothing answers: try again in a minute.",
};

export const view = viewOf({
  // What the address says of a log-in that just ended is taken out of it before anything is asked.
  async begin() {
    const words = new URLSearchParams(location.search);
    const ended = words.get("login");
    if (ended === null) return;
    words.delete("login");
    history.replaceState(null, "", `${location.pathname}${words.size ? `?${words}` : ""}`);
    if (ended === "done") setKey((await post("/v1/login/key", {}).catch(() => ({ key: "" }))).key);
    else tell("notice", REFUSED[ended] ?? REFUSED.refused);
  },
  start: () => on("key-wanted", async () => {
    const { url } = await request("/v1/login").catch(() => ({ url: null }));
    show(byId("key-login"), url ? el("a", { href: url }, "Log in with your account") : "");
  }),
});
