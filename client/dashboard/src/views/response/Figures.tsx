import { useComputed } from "@preact/signals";

import { rangeOfTime_m } from "../../physics/constants";
import { deviation, fixed } from "../../scales/format";
import type { Pixel } from "../../store/pixel";
import { useStore } from "../../store/store";

/** Range, time and light of the first return of a pixel, each with its standard deviation over the last frames. */
export function PixelFigures({ pixel }: { pixel: Pixel }) {
  const { frames, noises } = useStore();
  const figures = useComputed(() => {
    const ofLight = frames.amplitude.value;
    const [range, light] = [frames.of("range").value, frames.of(ofLight).value];
    // Read so that this follows what was measured.
    void [noises.of("range").frames.value, noises.of(ofLight).frames.value];
    if (range === null || light === null) return null;
    const at = pixel.y * range.shape[1] + pixel.x;
    return {
      range_m: range.values[at],
      range_std_m: noises.of("range").std(at),
      light: light.values[at],
      light_std: noises.of(ofLight).std(at),
      ofLight,
      unit: light.unit,
    };
  });
  if (figures.value === null) return null;
  const { range_m, range_std_m, light, light_std, ofLight, unit } = figures.value;
  const time_ns = (range_m / rangeOfTime_m(1)) * 1e9;
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
      <caption class="quiet" title="Standard deviations (1 σ) over the last frames, as measured at this pixel">
        This pixel, ± 1 σ
      </caption>
      <tbody>
        {row("range", fixed(range_m, 3, "m"), deviation(range_std_m, "m"), "pixel-range")}
        {row("time", fixed(time_ns, 2, "ns"), deviation(range_std_m / rangeOfTime_m(1), "s"), "pixel-time")}
        {row(ofLight, fixed(light, 0, unit), deviation(light_std, unit), "pixel-light")}
      </tbody>
    </table>
  );
}
