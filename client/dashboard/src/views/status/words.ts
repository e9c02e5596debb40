/** Words of the header. */

import { fixed } from "../../scales/format";
import { THINNED } from "../../store/frames";
import type { Decision } from "../../stream/demand";

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
