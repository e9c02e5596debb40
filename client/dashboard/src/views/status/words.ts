/** Words of the header. */
import type { Decision } from "../../stream/demand";
import { fixed } from "../../ui/format";

/** What is asked for over a thin link, as a sign and as sentences; `zoomed` where only a part of the picture is in sight. */
export function demandWords({ demand: { maxRate_hz, coded, part }, carried_bytes_s }: Decision, zoomed: boolean): { readonly short: string; readonly long: string } {
  const rate = fixed(maxRate_hz, (maxRate_hz ?? 0) < 1 ? 2 : 1, "Hz");
  const cut = !part ? [] : [zoomed ? "the part in sight" : "every 2nd pixel"];
  const codes = coded ? ["16 bits"] : [];
  return {
    short: ["Thin link: " + rate, ...codes, ...cut].join(", "),
    long: `The link to the service carried ${fixed(carried_bytes_s / 1e6, 2, "MB/s")}, which is less than all frames take. So this page asks for ${[`at most ${rate}`, ...codes.map((each) => `numbers in ${each}`), ...cut.map((each) => `${each} only`)].join(", ")}, and for more again where that arrives in time. The page's menu turns this off.`,
  };
}
