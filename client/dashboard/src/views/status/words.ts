/** Words of the header. */

import { engineering, fixed } from "../../scales/format";
import type { Span } from "../../scales/scale";
import { kindOf } from "../../store/api";
import type { Credentials } from "../../store/credentials";
import { THINNED } from "../../store/frames";
import type { Decision } from "../../stream/demand";
import type { AppliedDocument, FrameMeta } from "../../stream/documents";

/** Why the service lets this page in no more, or not yet. */
export function tokenWords({ token, refused }: Credentials): string {
  return token.value !== null && refused.value !== null && kindOf(refused.value) === "token-refused"
    ? "The service does not know this token: it may be mistyped, revoked or expired."
    : "The service requires a token. Its operator makes one with transientcam token create.";
}

/** Least share of saturated and of dark pixels that something is done about, and from where on much; where the bright ones have little of the full scale, too, fewer dark ones count. Of saturated ones what may stay once something is done. */
const [SATURATED, DARK, MOST, FAINT, FAINT_SCALE, LEFT] = [0.1, 0.5, 0.8, 0.02, 1 / 16, 0.01];

/** What to do about a frame with too much or too little light: the exposure to try, null where the camera has none; null where there is enough. */
export function exposureAdvice(
  meta: FrameMeta | null,
  { min_exposure_s: least_s = 0, max_exposure_s: most_s = Infinity, bits }: Readonly<Record<string, unknown>>,
  brightest_dn = Infinity,
  begun = false,
): { readonly word: string; readonly long: string; readonly exposure_s: number | null } | null {
  if (!meta?.pixels) return null;
  const { pixels, exposure_s } = meta;
  const [bright, dark] = [pixels.saturated / pixels.total, pixels.no_signal / pixels.total];
  const [word, share, why] =
    bright >= (begun ? LEFT : SATURATED) ? ["Saturated", bright, "are saturated"] : ["Dark", dark, "get too little light"];
  const faint = word === "Dark" && brightest_dn < FAINT_SCALE * 2 ** Number(bits) && exposure_s < Number(most_s);
  if (word === "Dark" && dark < (faint ? FAINT : DARK)) return null;
  // Where even the darkest are saturated, the brightest are so by far.
  const much = word === "Saturated" && share >= 1 - LEFT ? 32 : 8;
  const factor = (share >= MOST || faint ? much : 2) ** (word === "Dark" ? 1 : -1);
  const wanted_s = Math.min(Number(most_s), Math.max(Number(least_s), Number((factor * exposure_s).toPrecision(2))));
  const remedy =
    wanted_s === exposure_s ? "no exposure of this camera mends that" : `sets the exposure to ${engineering(wanted_s, "s", 2)}`;
  const long = `${fixed(100 * share, 0, "%")} of the pixels ${why} and have no value: ${remedy}`;
  return { word, long, exposure_s: wanted_s === exposure_s ? null : wanted_s };
}

/** Shares of the unambiguous range below and above which ranges lie at its ends. */
const [NEAR_END, FAR_END] = [0.03, 0.95];

/** The base frequency to try where ranges lie at the ends of what is unambiguous, as what is farther seems near; null where none do. */
export function lowerFrequency_hz(
  span: Span | null,
  { base_frequency_hz, unambiguous_range_m }: Pick<AppliedDocument, "base_frequency_hz" | "unambiguous_range_m">,
  { min_frequency_hz: least_hz = Infinity }: Readonly<Record<string, unknown>>,
): number | null {
  const inside = span === null || (span.low > NEAR_END * unambiguous_range_m && span.high < FAR_END * unambiguous_range_m);
  return inside || base_frequency_hz / 2 < Number(least_hz) ? null : base_frequency_hz / 2;
}

/** What less is asked for, as a sign and as sentences; `zoomed` where only a part of the picture is in sight. */
export function demandWords(
  { demand: { maxRate_hz, coded, part }, carried_bytes_s, pictures_hz }: Decision,
  zoomed: boolean,
): { readonly short: string; readonly long: string } {
  const rate = maxRate_hz === null ? [] : [fixed(maxRate_hz, maxRate_hz < 1 ? 2 : 1, "Hz")];
  const cut = !part ? [] : [zoomed ? "the part in sight" : THINNED];
  const codes = coded ? ["16 bits"] : [];
  const link =
    carried_bytes_s === null
      ? []
      : [`The link to the service carried ${fixed(carried_bytes_s / 1e6, 2, "MB/s")}, which is less than all frames take.`];
  const page =
    pictures_hz === null
      ? []
      : [`Before, this browser drew ${fixed(pictures_hz, 0, "")} pictures of the light a second, which do not flow.`];
  const asked = [
    ...rate.map((each) => `at most ${each}`),
    ...codes.map((each) => `numbers in ${each}`),
    ...cut.map((each) => `${each} only`),
  ].join(", ");
  return {
    short: `${link.length > 0 ? "Thin link" : "Slow browser"}: ${[...rate, ...codes, ...cut].join(", ")}`,
    long: [
      ...link,
      ...page,
      `So this page asks for ${asked}, and for more again where there is room. The page's menu turns this off.`,
    ].join(" "),
  };
}
