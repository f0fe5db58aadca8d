// Server-sent events through fetch, so that a key can go along; broken streams are taken up again.

import { Problem, fetched, lost, pause, request } from "./api.js";

// Yields {event, data, id} of a body as it arrives.
export async function* eventsOf(body) {
  const reader = body.pipeThrough(new TextDecoderStream()).getReader();
  let text = "";
  try {
    for (;;) {
      const { value, done } = await reader.read();
      if (done) return;
      text += value;
      const blocks = text.split(/\r?\n\r?\n/);
      text = blocks.pop();
      for (const block of blocks) {
        const event = parsed(block);
        if (event) yield event;
      }
    }
  } finally {
    reader.cancel().catch(() => undefined);
  }
}

function parsed(block) {
  const event = { event: "message", data: "", id: undefined };
  for (const line of block.split(/\r?\n/)) {
    const [, field, value] = /^([a-z]*):? ?(.*)$/.exec(line) ?? [];
    if (field === "event") event.event = value;
    else if (field === "data") event.data += value;
    else if (field === "id") event.id = value;
  }
  return event.data ? { ...event, data: JSON.parse(event.data) } : null;
}

// Follows a job to its end through broken connections and restarts; resolves to the job.
export async function watch(jobId, { onProgress, onPoints, signal } = {}) {
  let last;
  for (;;) {
    try {
      const headers = { Accept: "text/event-stream", ...(last ? { "Last-Event-ID": last } : {}) };
      const answer = await fetched(`/v1/jobs/${jobId}/events`, { headers, signal });
      if (answer.status !== 204) {
        for await (const { event, data, id } of eventsOf(answer.body)) {
          last = id ?? last;
          if (event === "end") return data;
          if (event === "progress") onProgress?.(data);
          if (event === "partial") onPoints?.(data);
        }
      }
      const job = await request(`/v1/jobs/${jobId}`, { signal });
      if (["successful", "failed", "dismissed"].includes(job.status)) return job;
      await pause(0.3);
    } catch (error) {
      if (error.name === "AbortError" || error instanceof Problem) throw error;
      await lost();
    }
  }
}
