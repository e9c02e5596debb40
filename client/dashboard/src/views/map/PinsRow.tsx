import { deviation, fixed } from "../../scales/format";
import type { Look } from "../../store/looks";
import { LONGEST_NOTE, PIN_COLOURS, type Pin } from "../../store/measures";
import { useStore } from "../../store/store";
import { Remove } from "../../ui/controls";
import { useProducts } from "../../ui/hooks";
import { distanceOf, lensOf, type Ranged } from "../points/lens";
import { valueAtPixel } from "./Readout";

/** The values at the pins, and how far what two of them see is apart. */
export function PinsRow({ look }: { look: Look }) {
  const store = useStore();
  const { measures, rangeErrors } = store;
  useProducts(["range"]);
  const ranges = store.frames.of("range");
  const pins = measures.pins.value;
  const range = ranges.value;
  const ranged = (pin: Pin): Ranged | null => {
    const range_m = valueAtPixel(range, pin);
    return Number.isNaN(range_m) ? null : { x: pin.x, y: pin.y, range_m, error_m: rangeErrors.at("range_error", pin) };
  };
  const pairs = pins.flatMap((a, n) => pins.slice(n + 1).map((b) => [a, b] as const));
  return (
    <div class="panel-row wrapped measured" role="group" aria-label="Pins">
      {pins.map((pin) => (
        <span key={pin.name} data-pin={pin.name}>
          <b class="pin" style={{ "--pin": PIN_COLOURS[pin.name] }}>
            {pin.name}
          </b>{" "}
          {fixed(valueAtPixel(look.frame.value, pin), look.product.decimals, look.product.unit)}{" "}
          <input
            type="text"
            class="pin-note"
            aria-label={`Note at ${pin.name}`}
            placeholder="note"
            maxLength={LONGEST_NOTE}
            value={pin.note ?? ""}
            onInput={(event) => measures.annotate(pin.name, event.currentTarget.value)}
          />
        </span>
      ))}
      {range !== null &&
        pairs.map(([a, b]) => {
          const [from, to] = [ranged(a), ranged(b)];
          const apart = from === null || to === null ? null : distanceOf(lensOf(store, range.shape[1], range.shape[0]), from, to);
          return (
            <span
              key={`${a.name}${b.name}`}
              data-distance={`${a.name}${b.name}`}
              title="Distance of the two points in space, with half of the 90 % interval, from those of both ranges"
            >
              <span class="quiet">
                {a.name} to {b.name}
              </span>{" "}
              {fixed(apart?.distance_m, 3, "m")} <span class="quiet">{deviation(apart?.error_m, "m")}</span>
            </span>
          );
        })}
      <Remove what="Remove pins" onClick={() => (measures.pins.value = [])} />
    </div>
  );
}
