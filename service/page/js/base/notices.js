// What the page says about itself: the service away, a refusal, a key wanted.

import { setKey } from "../network/api.js";
import { button, byId, onSubmit, say, show } from "./dom.js";
import { on, tell } from "./state.js";

const NOTICE_SECONDS = 12;
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
  on("key-wanted", (problem) => {
    byId("key-form").hidden = false;
    say("key-status", problem.message);
  });
  onSubmit(byId("key-form"), () => {
    setKey(byId("key").value.trim());
    byId("key").value = "";
    byId("key-form").hidden = true;
    tell("key");
  });
}
