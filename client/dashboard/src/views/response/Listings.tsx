import { rangeOfTime_m } from "../../physics/constants";
import { deviation, engineering, fixed } from "../../scales/format";
import { useStore } from "../../store/store";
import type { PixelDocument } from "../../stream/documents";
import { FLAGS } from "../../ui/flags";
import type { FlagHistory } from "./flagShares";
import { linesOf, type ReturnHistory, type ReturnLine, sifted } from "./returns";
import "./Listings.css";

type FoundProps = Readonly<{ details: PixelDocument | null; of: number | null; flags: FlagHistory; returns: ReturnHistory }>;

/** What the service found at the pixel: returns, the truth where it is known, and flags. `of` is the number of the frame that the curves are of. */
export function Found({ details, of, flags, returns }: FoundProps) {
  const { frames } = useStore();
  if (details === null) return null;
  const scene = frames.sceneOf(details.meta);
  flags.take(details, scene);
  returns.take(details, scene);
  return (
    <>
      {of !== null && of !== details.meta.frame && (
        <p class="quiet">
          These values are of frame {details.meta.frame}; the curves are of frame {of}, which the service keeps no more.
        </p>
      )}
      <ReturnTable details={details} history={returns} />
    </>
  );
}

/** Flags with how often they were set lately: at the foot, so that nothing moves when one comes or goes. */
export function FlagWords({ flags, looked }: { flags: FlagHistory; looked: boolean }) {
  if (!looked) return null;
  const shares = flags.shares();
  const shown = FLAGS.flatMap(({ name, title, words }) => {
    const found = shares.find((each) => each.name === name);
    return found === undefined ? [] : [{ name, title, words, share: found.share }];
  });
  return (
    <ul class="flag-words small" data-field="flags">
      {shown.length === 0 && <li>Nothing was wrong with this pixel.</li>}
      {shown.map(({ name, title, words, share }) => (
        <li key={name} data-flag={name}>
          <strong>{title}</strong> in {fixed(100 * share, 0, "%")} of {flags.looks === 1 ? "1 look" : `${flags.looks} looks`}: {words}.
        </li>
      ))}
    </ul>
  );
}

/** Lines of the table, however many returns there are: what stands below keeps its place. */
const LINES = 4;

/** The returns of the pixel, each with its standard deviation, beside the true ones where these are known. */
function ReturnTable({ details, history }: { details: PixelDocument; history: ReturnHistory }) {
  const { strong, weak, weakShare } = sifted(details.returns);
  const lines = linesOf(strong, sifted(details.truth?.returns ?? []).strong);
  const beyond = Math.max(0, lines.length - LINES);
  const notes = [
    beyond > 0 ? `${beyond} more` : "",
    weak > 0 ? `${weak} weak, together ${fixed(100 * weakShare, 1, "%")} of the light` : "",
  ];
  return (
    <div>
      <table class="listing returns" data-field="returns">
        <caption class="quiet" title="Standard deviations (1 σ) over the last looks at this pixel; the true returns of a simulated scene">
          Returns, ± 1 σ
        </caption>
        <thead>
          <tr>
            {["time", "range", "light", "truth", "difference"].map((name) => (
              <th key={name} scope="col">
                {name}
              </th>
            ))}
          </tr>
        </thead>
        <tbody>
          {Array.from({ length: LINES }, (_, at) => (
            <ReturnRow key={at} line={lines[at] ?? NO_LINE} history={history} />
          ))}
        </tbody>
      </table>
      <p class="small quiet listing-rest">{notes.filter((note) => note !== "").join("; ")}</p>
    </div>
  );
}

/** How far a return is from the true one, as a range. */
function differenceOf({ found, truth }: ReturnLine): string {
  if (truth === null) return "";
  if (found === null) return "not found";
  const difference_m = rangeOfTime_m(found.time_s - truth.time_s);
  return `${difference_m > 0 ? "+" : ""}${engineering(difference_m, "m", 2)}`;
}

const NO_LINE: ReturnLine = { found: null, truth: null };

function ReturnRow({ line, history }: { line: ReturnLine; history: ReturnHistory }) {
  const { found, truth } = line;
  const scatter = found === null ? null : history.of(found);
  const cell = (value: string, std: string) => (
    <td>
      {value}
      <small class="quiet">{std}</small>
    </td>
  );
  return (
    <tr data-found={found !== null} data-true={truth !== null}>
      {cell(found === null ? "" : fixed(found.time_s * 1e9, 2, "ns"), deviation(scatter?.time_s, "s"))}
      {cell(found === null ? "" : fixed(rangeOfTime_m(found.time_s), 2, "m"), deviation(rangeOfTime_m(scatter?.time_s ?? NaN), "m"))}
      {cell(found === null ? "" : fixed(found.weight, 0, "DN"), deviation(scatter?.weight, "DN"))}
      {cell(truth === null ? "" : fixed(rangeOfTime_m(truth.time_s), 2, "m"), truth === null ? "" : fixed(truth.weight, 0, "DN"))}
      <td>{differenceOf(line)}</td>
    </tr>
  );
}
