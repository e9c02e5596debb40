import type { ReadonlySignal } from "@preact/signals";

import type { Pixel } from "../../physics/reflection";
import { fixed } from "../../scales/format";
import "./MomentsPlane.css";

/** A little more than the unit circle, so that labels have room. */
const REACH = 1.25;

/** The moments over b_0 on the complex plane: no light can put them outside of the unit circle. */
export function MomentsPlane({ pixel }: { pixel: ReadonlySignal<Pixel | null> }) {
  if (pixel.value === null) return <p class="stage-empty cover">This pixel has no density.</p>;
  const { moments } = pixel.value;
  const points = Array.from({ length: moments.length / 2 - 1 }, (_, at) => {
    const [re, im] = [moments[2 * at + 2] / moments[0], moments[2 * at + 3] / moments[0]];
    return { j: at + 1, re, im };
  });
  return (
    <div class="moments grow">
      <svg
        class="plot moments-plane"
        viewBox={`${-REACH} ${-REACH} ${2 * REACH} ${2 * REACH}`}
        role="img"
        aria-label="Moments over b₀ on the complex plane"
      >
        <circle class="moments-circle" r="1" />
        <circle class="moments-ring" r="0.5" />
        <path class="moments-ring" d={`M${-REACH} 0H${REACH}M0 ${-REACH}V${REACH}`} />
        <polyline class="moments-path" points={[{ re: 1, im: 0 }, ...points].map(({ re, im }) => `${re},${-im}`).join(" ")} />
        <circle class="moments-first" cx="1" cy="0" r="0.03" />
        {points.map(({ j, re, im }) => (
          <g key={j} data-moment={j}>
            <circle class="moments-point" cx={re} cy={-im} r="0.04" />
            <text class="moments-label" x={re + 0.06} y={-im - 0.06}>
              {j}
            </text>
          </g>
        ))}
      </svg>
      <table class="listing">
        <caption class="quiet">Moments over b₀</caption>
        <thead>
          <tr>
            <th scope="col">j</th>
            <th scope="col">modulus</th>
            <th scope="col">phase</th>
          </tr>
        </thead>
        <tbody>
          {points.map(({ j, re, im }) => (
            <tr key={j}>
              <td>{j}</td>
              <td>{fixed(Math.hypot(re, im), 3)}</td>
              <td>{fixed((Math.atan2(im, re) * 180) / Math.PI, 1, "°")}</td>
            </tr>
          ))}
        </tbody>
      </table>
    </div>
  );
}
