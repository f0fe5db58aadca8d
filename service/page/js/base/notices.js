// What the page says about itself: the service away, a refusal, a key wanted; logging in with the organisation's account.

import { post, request, setKey } from "../network/api.js";
import { button, byId, el, onSubmit, say, show } from "./dom.js";
import { on, tell } from "./state.js";

const NOTICE_SECONDS = 12;
const REFUSED = {
  expired: "The log-in took too long: begin again.",
  refused: "The log-in was refused where your organisation's accounts are.",
  "not-allowed": "Your account may not use this service: ask who runs it.",
  unreachable: "Where your organisation's accounts are, nothing answers: try again in a minute.",
};
let fading = 0;

// The banner says something, or nothing; what stays does so until something else is said.
function told(words, stays = false) {
  clearTimeout(fading);
  show(byId("banner"), words);
  byId("banner").hidden = !words;
  if (words && !stays) fading = setTimeout(silent, NOTICE_SECONDS * 1000);
}

function silent() {
  byId("banner").hidden = true;
}

export function startNotices() {
  on("offline", () => told("The service does not answer. Nothing is lost: this page goes on when it is back.", true));
  on("online", silent);
  // While the service starts the banner says what; what goes on then is not for it to hide.
  on("starting", (text) => told(text ?? "", true));
  on("notice", (text) => told([text, " ", button("Close", silent)]));
  on("key-wanted", async (problem) => {
    byId("key-form").hidden = false;
    say("key-status", problem.message);
    const { url } = await request("/v1/login").catch(() => ({ url: null }));
    show(byId("key-login"), url ? el("a", { href: url }, "Log in with your account") : "");
  });
  onSubmit(byId("key-form"), () => {
    setKey(byId("key").value.trim());
    byId("key").value = "";
    byId("key-form").hidden = true;
    tell("key");
  });
}

// What the address says of a log-in that just ended is taken out of it before anything is asked.
export async function finishLogin() {
  const words = new URLSearchParams(location.search);
  const ended = words.get("login");
  if (ended === null) return;
  words.delete("login");
  history.replaceState(null, "", `${location.pathname}${words.size ? `?${words}` : ""}`);
  if (ended === "done") setKey((await post("/v1/login/key", {}).catch(() => ({ key: "" }))).key);
  else tell("notice", REFUSED[ended] ?? REFUSED.refused);
}
