// What the page says about itself: the service away, a key wanted, a refusal.

import { setKey } from "../network/api.js";
import { byId, el, say, show } from "./dom.js";
import { on, tell } from "./events.js";

const NOTICE_SECONDS = 12;
let fading = 0;

export function startNotices() {
  const banner = byId("banner");
  on("offline", () => {
    clearTimeout(fading);
    show(banner, "The service does not answer. Nothing is lost: this page goes on when it is back.");
    banner.hidden = false;
  });
  on("online", () => {
    banner.hidden = true;
  });
  // While the service starts the banner says what; what goes on then is not for it to hide.
  on("starting", (text) => {
    clearTimeout(fading);
    show(banner, text ?? "");
    banner.hidden = !text;
  });
  on("notice", (text) => {
    clearTimeout(fading);
    show(banner, text, " ", el("button", { type: "button", onclick: () => { banner.hidden = true; } }, "Close"));
    banner.hidden = false;
    fading = setTimeout(() => { banner.hidden = true; }, NOTICE_SECONDS * 1000);
  });
  on("key-wanted", (problem) => {
    byId("key-form").hidden = false;
    say("key-status", problem.message);
  });
  byId("key-form").addEventListener("submit", (event) => {
    event.preventDefault();
    setKey(byId("key").value.trim());
    byId("key").value = "";
    byId("key-form").hidden = true;
    tell("key");
  });
}
