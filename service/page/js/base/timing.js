// How long a job has run and how long it may still, in words.

const RELIABLE = 0.03;

const span = (ms) => {
  const total = Math.max(Math.round(ms / 1000), 0);
  if (total < 60) return `${total} s`;
  if (total < 3600) return `${Math.floor(total / 60)} min ${total % 60} s`;
  return `${Math.floor(total / 3600)} h ${Math.floor((total % 3600) / 60)} min`;
};

// " 40 %, 12 s, about 18 s more" of a job that runs; what it will take is not said before there is enough to go by.
export function timing({ status, progress, started }, now = Date.now()) {
  if (status !== "running") return "";
  const share = ` ${Math.round(100 * progress)} %`;
  if (!started) return share;
  const elapsed = now - Date.parse(started);
  const left = progress > RELIABLE && progress < 1 && elapsed > 1000 ? `, about ${span((elapsed * (1 - progress)) / progress)} more` : "";
  return `${share}, ${span(elapsed)}${left}`;
}
