// Previews: two at a time under way for each purpose, the newest wish next; what is overtaken is never sent.

import { patiently, pause, post } from "./api.js";

const LONGEST_PAUSE = 5;
const AT_A_TIME = 2;
const session = Math.random().toString(36).slice(2, 10);

export function previewer(purpose, onAnswer, onError) {
  // The service computes only the newest of a client: each of those under way is a client of its own.
  const free = Array.from({ length: AT_A_TIME }, (_, lane) => `${session}-${purpose}-${lane}`);
  let wanted = null;
  let asked = 0;
  let told = 0;

  async function turn() {
    if (!wanted || !free.length) return;
    const { body, token } = wanted;
    const client = free.pop();
    const number = ++asked;
    wanted = null;
    try {
      const begun = performance.now();
      const answer = await patiently(() => post("/v1/previews", { ...body, client }));
      const milliseconds = performance.now() - begun;
      // Drawn once the next wish is on its way: the service computes while the browser draws.
      setTimeout(() => {
        if (number < told) return;
        told = number;
        onAnswer(answer, { milliseconds, token });
      });
    } catch (error) {
      if (number > told) onError(error, token);
      // Too many just now: the same is asked again, unless something newer is wanted.
      if (error.retryAfter) {
        await pause(Math.min(error.retryAfter, LONGEST_PAUSE));
        if (number === asked) wanted ??= { body, token };
      }
    }
    free.push(client);
    turn();
  }

  return (body, token) => {
    wanted = { body, token };
    turn();
  };
}
