import { rangeOfTime_m } from "../../physics/constants";
import type { Peak } from "../../physics/impulseResponse";
import type { PixelDocument, Return } from "../../stream/protocol";
import { FLAGS } from "../../ui/flags";
import { fixed } from "../../ui/format";
import type { FlagHistory } from "./flagShares";

/** The maxima of the density and the light around each. */
export function PeakTable({ peaks: listed }: { peaks: readonly Peak[] }) {
  if (listed.length === 0) return null;
  return (
    <table class="listing peaks">
      <caption class="quiet">Peaks of the density</caption>
      <thead>
        <tr>
          <th scope="col">time</th>
          <th scope="col">range</th>
          <th scope="col">light</th>
        </tr>
      </thead>
      <tbody>
        {listed.map((peak, at) => (
          <tr key={at}>
            <td>{fixed(peak.time_s * 1e9, 2, "ns")}</td>
            <td>{fixed(rangeOfTime_m(peak.time_s), 2, "m")}</td>
            <td>{fixed(100 * peak.share, 0, "%")}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}

/** What the service found at the pixel: returns, the truth where it is known, and flags. `held` is the number of the frame that is held. */
export function Found({ told, held, flags }: { told: PixelDocument | null; held: number | null; flags: FlagHistory }) {
  if (told === null) return null;
  flags.take(told);
  const { truth } = told;
  return (
    <>
      {held !== null && held !== told.meta.frame && (
        <p class="quiet">
          The service tells of frame {told.meta.frame}; the curves are of frame {held}, which is held.
        </p>
      )}
      <ReturnTable name="returns" caption="Returns" returns={told.returns} />
      {truth !== null && <ReturnTable name="truth" caption={truth.kind === "sparse" ? "True returns" : "Strongest true returns"} returns={truth.returns} />}
      <FlagWords flags={flags} />
    </>
  );
}

/** Flags with how often they were set lately: at the foot, so that nothing moves when one comes or goes. */
function FlagWords({ flags }: { flags: FlagHistory }) {
  const shares = flags.shares();
  const shown = FLAGS.flatMap(({ name, title, words }) => {
    const found = shares.find((each) => each.name === name);
    return found === undefined ? [] : [{ name, title, words, share: found.share }];
  });
  return (
    <ul class="flag-words" data-field="flags">
      {shown.length === 0 && <li>Nothing was wrong with this pixel.</li>}
      {shown.map(({ name, title, words, share }) => (
        <li key={name} data-flag={name}>
          <strong>{title}</strong> in {fixed(100 * share, 0, "%")} of {flags.looks === 1 ? "1 look" : `${flags.looks} looks`}: {words}.
        </li>
      ))}
    </ul>
  );
}

/** Returns with less than this share of the light are told of together. */
const WEAK_SHARE = 0.02;

/** The returns that are worth a line, by time, and the light of the others together. */
export function sifted(returns: readonly Return[]): { readonly strong: readonly Return[]; readonly weak: number; readonly weakShare: number } {
  const light = returns.reduce((sum, { weight }) => sum + Math.max(0, weight), 0);
  const strong = returns.filter(({ weight }) => weight >= WEAK_SHARE * light);
  const rest = returns.filter((each) => !strong.includes(each));
  return { strong, weak: rest.length, weakShare: light > 0 ? rest.reduce((sum, { weight }) => sum + weight, 0) / light : 0 };
}

function ReturnTable({ name, caption, returns }: { name: string; caption: string; returns: readonly Return[] }) {
  if (returns.length === 0) return null;
  const { strong, weak, weakShare } = sifted(returns);
  return (
    <div class="listing-room">
      <table class={`listing listing-${name}`} data-field={name}>
        <caption class="quiet">{caption}</caption>
        <thead>
          <tr>
            <th scope="col">time</th>
            <th scope="col">range</th>
            <th scope="col">light</th>
          </tr>
        </thead>
        <tbody>
          {strong.map(({ time_s, weight }, at) => (
            <tr key={at}>
              <td>{fixed(time_s * 1e9, 2, "ns")}</td>
              <td>{fixed(rangeOfTime_m(time_s), 2, "m")}</td>
              <td>{fixed(weight, 0, "DN")}</td>
            </tr>
          ))}
        </tbody>
      </table>
      <p class="quiet listing-rest">{weak > 0 && `and ${weak} weaker, together ${fixed(100 * weakShare, 1, "%")} of the light`}</p>
    </div>
  );
}
