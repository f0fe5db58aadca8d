// Previews: one at a time under way for each purpose, the newest wish next; what is overtaken is never sent.

import { patiently, pause, post } from "./api.js";

const LONGEST_PAUSE = 5;

const session = Math.random().toString(36).slice(2, 10);

export function previewer(purpose, onAnswer, onError) {
  const client = `${session}-${purpose}`;
  let wanted = null;
  let busy = false;

  async function turn() {
    if (busy) return;
    busy = true;
    while (wanted) {
      const { body, token } = wanted;
      wanted = null;
      try {
        const begun = performance.now();
        const answer = await patiently(() => post("/v1/previews", { ...body, client }));
        const milliseconds = performance.now() - begun;
        // Drawn once the next wish is on its way: the service computes while the browser draws.
        setTimeout(() => onAnswer(answer, { milliseconds, token }));
      } catch (error) {
        onError(error, token);
        // Too many just now: the same is asked again, unless something newer is wanted.
        if (error.retryAfter) {
          await pause(Math.min(error.retryAfter, LONGEST_PAUSE));
          wanted ??= { body, token };
        }
      }
    }
    busy = false;
  }

  return (body, token) => {
    wanted = { body, token };
    turn();
  };
}
