/** States of the page that show what it can do, each a link. */

export interface Example {
  readonly name: string;
  readonly words: string;
  /** The simulated scene that it is best seen on. */
  readonly scene?: string;
  /** What a link to it says behind #. */
  readonly state: string;
}

export const EXAMPLES: readonly Example[] = [
  {
    name: "Light in flight over the points",
    words: "The room in space, lit by what arrives at one time of flight. Drag to turn it.",
    state: "view=points&points=flight",
  },
  {
    name: "Several returns in one pixel",
    words:
      "By way of a mirror light comes back more than once: each return is a peak, within bounds that any light with these moments keeps.",
    scene: "mirrors",
    state: "view=response&side=bounds&lit=on",
  },
  {
    name: "Direct beside indirect light",
    words: "What came back at once, and what took a longer way.",
    state: "layout=3:map.1,second-map.1/2:plots.1,response.1&map=direct&map2=indirect",
  },
  {
    name: "Which ranges to trust",
    words: "Half of each pixel's 90 % interval, and why a range is not trusted.",
    state: "layout=1:map.1,validity.1&map=range_error&trust=on",
  },
  {
    name: "The price of accuracy",
    words: "What each sequence would give on this scene, and take: press Predict, then move along the front.",
    state: "view=sequence",
  },
  {
    name: "A corner, by two estimators",
    words: "Walls that light each other: a curve of maximum entropy, stems of maximum likelihood, and the truth.",
    scene: "corner",
    state: "view=response&side=density&lit=on",
  },
];
