/**
 * Colour maps as tables of 256 colours.
 *
 * Viridis, inferno and cividis are perceptually uniform and read by colour-blind eyes; they are given by
 * every fifteenth entry of the tables published with matplotlib (public domain, CC0; cividis after
 * Nuñez, Anderton, Renslow 2018) and joined by straight lines, which stays within 11/255 of the original
 * (viridis and inferno within 5/255). Coolwarm (after Moreland 2009) diverges: it is for values whose zero
 * means something.
 */

const STOPS = {
  viridis: "440154 481769 472a7a 433d84 3d4e8a 355e8d 2e6d8e 297b8e 23898e 1f978b 21a585 2eb37c 46c06f 65cb5e 89d548 b0dd2f d8e219 fde725",
  cividis: "00224e 002d68 163770 2e416d 3f4c6c 4e566c 5c616e 696b71 767676 838179 928c78 a09875 afa471 bfb06b cfbd62 dfca57 f0d846 fee838",
  inferno: "000004 0a0722 1e0c45 380962 510e6c 69166e 801f6c 982766 b0315b c63d4d d94d3d e9612b f47918 fa9407 fcb014 f8cd37 f2ea69 fcffa4",
  grey: "000000 ffffff",
  coolwarm: "3b4cc0 4c66d6 5f7fe8 7396f5 88abfd 9dbdff b1cbfc c4d5f3 d5dbe5 e4d9d2 f0cdbb f6bea4 f7aa8c f39475 e97a5f dc5d4a ca3b37 b40426",
} as const;

/** Colours of what lies below and above a scale: distinct from its ends, without outshining the picture. */
const BEYOND: Readonly<Record<keyof typeof STOPS, readonly [under: string, over: string]>> = {
  viridis: ["1c0029", "fffbd5"],
  cividis: ["000914", "fffac9"],
  inferno: ["07334d", "ffffff"],
  grey: ["0b2a55", "ffc9b0"],
  coolwarm: ["1a2370", "6b0019"],
};

export type ColourMapName = keyof typeof STOPS;

export const COLOUR_MAPS = Object.keys(STOPS) as ColourMapName[];

/** Entries of every table. */
export const LEVELS = 256;

/** 256 colours as RGBA bytes. */
export type ColourTable = Uint8ClampedArray<ArrayBuffer>;

function tabulate(stops: string): ColourTable {
  const colours = stops.split(" ").map((hex) => [0, 2, 4].map((at) => parseInt(hex.slice(at, at + 2), 16)));
  const table = new Uint8ClampedArray(4 * LEVELS);
  for (let level = 0; level < LEVELS; level++) {
    const position = (level / (LEVELS - 1)) * (colours.length - 1);
    const low = Math.min(Math.floor(position), colours.length - 2);
    const weight = position - low;
    for (let channel = 0; channel < 3; channel++) {
      table[4 * level + channel] = (1 - weight) * colours[low][channel] + weight * colours[low + 1][channel];
    }
    table[4 * level + 3] = 255;
  }
  return table;
}

const tables = new Map<ColourMapName, ColourTable>();

/** The table of a colour map; the same array at every call. */
export function colourTable(name: ColourMapName): ColourTable {
  let table = tables.get(name);
  if (table === undefined) {
    table = tabulate(STOPS[name]);
    tables.set(name, table);
  }
  return table;
}

/** A colour as "1c0029", in RGBA bytes of one number (little endian, as all browsers are). */
export function rgbaOf(hex: string): number {
  const rgb = parseInt(hex, 16);
  return (0xff000000 | ((rgb & 0xff) << 16) | (rgb & 0xff00) | (rgb >> 16)) >>> 0;
}

/** The colours of what lies beyond a scale, as `rgbaOf` has them. */
export function beyond(name: ColourMapName): { readonly under: number; readonly over: number } {
  const [under, over] = BEYOND[name].map(rgbaOf);
  return { under, over };
}

/** The entry for a value at `fraction` of the way from a scale's low to its high end. */
export function levelOf(fraction: number): number {
  return Math.min(LEVELS - 1, Math.max(0, Math.floor(fraction * LEVELS)));
}
