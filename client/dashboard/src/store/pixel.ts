/** A place on the sensor: column from the left, row from the top. */
export type Pixel = Readonly<{ x: number; y: number }>;

/** As "81,20". */
export function pixelText({ x, y }: Pixel): string {
  return `${x},${y}`;
}

export function pixelOf(text: string): Pixel | undefined {
  const found = /^(\d{1,5}),(\d{1,5})$/.exec(text);
  return found === null ? undefined : { x: Number(found[1]), y: Number(found[2]) };
}

const STEPS: Readonly<Record<string, readonly [number, number] | undefined>> = {
  ArrowLeft: [-1, 0],
  ArrowRight: [1, 0],
  ArrowUp: [0, -1],
  ArrowDown: [0, 1],
};

/** The neighbour of a pixel that an arrow key leads to, of the middle where there is none; null for other keys. */
export function stepped(from: Pixel | null, key: string, width: number, height: number): Pixel | null {
  const step = STEPS[key];
  if (step === undefined) return null;
  const { x, y } = from ?? { x: width >> 1, y: height >> 1 };
  return { x: Math.min(width - 1, Math.max(0, x + step[0])), y: Math.min(height - 1, Math.max(0, y + step[1])) };
}
