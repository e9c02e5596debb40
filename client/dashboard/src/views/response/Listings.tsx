import { rangeOfTime_m } from "../../physics/constants";
import type { Peak } from "../../physics/impulseResponse";
import type { PixelDocument, Return } from "../../stream/protocol";
import { FLAGS } from "../../ui/flags";
import { fixed } from "../../ui/format";

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

/** What the service found at the pixel: flags in words, sparse returns, and the truth where it is known. `held` is the number of the frame that is held. */
export function Found({ told, held }: { told: PixelDocument | null; held: number | null }) {
  if (told === null) return null;
  const { truth } = told;
  return (
    <>
      {held !== null && held !== told.meta.frame && (
        <p class="quiet">
          The service tells of frame {told.meta.frame}; the curves are of frame {held}, which is held.
        </p>
      )}
      <ul class="flag-words" data-field="flags">
        {told.flags.length === 0 && <li>Nothing was wrong with this pixel.</li>}
        {FLAGS.filter(({ name }) => told.flags.includes(name)).map(({ name, title, words }) => (
          <li key={name} data-flag={name}>
            <strong>{title}:</strong> {words}.
          </li>
        ))}
      </ul>
      <ReturnTable name="returns" caption="Returns" returns={told.returns} />
      {truth !== null && <ReturnTable name="truth" caption={truth.kind === "sparse" ? "True returns" : "Strongest true returns"} returns={truth.returns} />}
    </>
  );
}

function ReturnTable({ name, caption, returns }: { name: string; caption: string; returns: readonly Return[] }) {
  if (returns.length === 0) return null;
  return (
    <table class={`listing listing-${name}`} data-field={name}>
      <caption class="quiet">{caption}</caption>
      <thead>
        <tr>
          <th scope="col">time</th>
          <th scope="col">range</th>
          <th scope="col">weight</th>
        </tr>
      </thead>
      <tbody>
        {returns.map(({ time_s, weight }, at) => (
          <tr key={at}>
            <td>{fixed(time_s * 1e9, 2, "ns")}</td>
            <td>{fixed(rangeOfTime_m(time_s), 2, "m")}</td>
            <td>{fixed(weight, 0, "DN")}</td>
          </tr>
        ))}
      </tbody>
    </table>
  );
}
