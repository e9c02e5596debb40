/** States of the page that show what it can do, each a link. */
import examples from "./examples.json";

export interface Example {
  readonly name: string;
  readonly words: string;
  /** The simulated scene that it is best seen on. */
  readonly scene?: string;
  /** What a link to it says behind #. */
  readonly state: string;
}

export const EXAMPLES: readonly Example[] = examples;
