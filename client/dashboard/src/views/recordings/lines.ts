/** Annotations as lines of text: values that are no text are written as JSON. */

export type Line = Readonly<{ name: string; text: string }>;

export function linesOf(annotations: Readonly<Record<string, unknown>>): Line[] {
  return Object.entries(annotations).map(([name, value]) => ({
    name,
    text: typeof value === "string" && !isJson(value) ? value : JSON.stringify(value),
  }));
}

/** What the lines say, without those that say nothing; null where a name is missing or stands twice. */
export function annotationsOf(lines: readonly Line[]): Record<string, unknown> | null {
  const said = lines.map(({ name, text }) => [name.trim(), text.trim()] as const).filter(([name, text]) => name !== "" || text !== "");
  const names = said.map(([name]) => name);
  if (names.includes("") || new Set(names).size !== names.length) return null;
  return Object.fromEntries(said.map(([name, text]) => [name, isJson(text) ? JSON.parse(text) : text]));
}

/** Whether a text would be read as something else than text: a number, a list, a quoted text. */
function isJson(text: string): boolean {
  try {
    JSON.parse(text);
    return true;
  } catch {
    return false;
  }
}
