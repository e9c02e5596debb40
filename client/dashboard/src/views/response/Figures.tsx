import { rangeOfTime_m } from "../../physics/constants";
import { deviation, fixed } from "../../scales/format";
import { useStore } from "../../store/store";
import type { PixelDocument } from "../../stream/documents";

/** Range, time and light of the first return of a pixel, by the service; of the range its error, of the light how it scatters. */
export function PixelFigures({ details }: { details: PixelDocument | null }) {
  const { frames, noises, rangeErrors } = useStore();
  const ofLight = frames.amplitude.value === "direct" ? "direct" : "brightness";
  const noise = noises.of(ofLight);
  void noise.frames.value; // read so that this follows what was measured
  const range_m = details?.range_m ?? NaN;
  const [error_m, light_std] =
    details === null ? [NaN, NaN] : [rangeErrors.at("range_error", details), noise.std(details.y * details.meta.width + details.x)];
  const row = (name: string, value: string, std: string, field: string) => (
    <tr>
      <th scope="row">{name}</th>
      <td data-field={field}>{value}</td>
      <td class="quiet" data-field={`${field}-std`}>
        {std}
      </td>
    </tr>
  );
  return (
    <table class="listing pixel-figures">
      <caption class="quiet" title="Half of the 90 % interval of the range; standard deviation (1 σ) of the light over the last frames">
        This pixel, range ± 90 %, light ± 1 σ
      </caption>
      <tbody>
        {row("range", fixed(range_m, 3, "m"), deviation(error_m, "m"), "pixel-range")}
        {row("time", fixed((range_m / rangeOfTime_m(1)) * 1e9, 2, "ns"), deviation(error_m / rangeOfTime_m(1), "s"), "pixel-time")}
        {row(ofLight, fixed(details?.[ofLight], 0, "DN"), deviation(light_std, "DN"), "pixel-light")}
      </tbody>
    </table>
  );
}
