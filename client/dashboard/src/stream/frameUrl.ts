/** Address of something about a frame whose own address may carry a query: `frames/3?a=b` and `range` to `frames/3/range?a=b`. */
export function frameUrl(frame: string, leaf: string): string {
  const [path, query] = frame.split("?");
  if (query === undefined) return `${path}/${leaf}`;
  return `${path}/${leaf}${leaf.includes("?") ? "&" : "?"}${query}`;
}
