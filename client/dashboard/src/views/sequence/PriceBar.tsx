import { useSignal } from "@preact/signals";
import { engineering, fixed } from "../../scales/format";
import { useStore } from "../../store/store";
import type { ChoiceDocument, PlanDocument } from "../../stream/documents";
import "./PriceBar.css";

/** What time goes to, in colours after Okabe and Ito, as the pins. */
const COLOURS = { light: "#e69f00", readout: "#56b4e9", settling: "#cc79a7", transport: "#009e73", computing: "#d55e00" };
const ITEMS = Object.keys(COLOURS) as (keyof typeof COLOURS)[];

/** What a capture takes until its ranges are there, item by item, and what would buy most of it. */
export function PriceBar({ choice }: { choice: ChoiceDocument | PlanDocument }) {
  const { price } = choice;
  const [sum_s, bytes, light_share] = [price.sum_s ?? 0, price.data_bytes ?? 0, price.light_share ?? 0];
  const known = ITEMS.filter((name) => (price[`${name}_s`] ?? 0) > 0);
  return (
    <figure class="price" data-field="choice_price">
      <div class="price-bar" aria-hidden="true">
        {known.map((name) => (
          <i key={name} style={{ background: COLOURS[name], flexGrow: (price[`${name}_s`] ?? 0) / sum_s }} />
        ))}
      </div>
      <figcaption class="small line">
        {known.map((name) => (
          <span key={name}>
            <i class="price-key" style={{ background: COLOURS[name] }} aria-hidden="true" /> {name}{" "}
            {engineering(price[`${name}_s`], "s", 2)}
          </span>
        ))}
        <span>
          sum {price.computing_s == null && "without computing "}
          {engineering(sum_s, "s", 2)}
        </span>
        <span class="quiet">
          {fixed(bytes / 1e6, 2, "MB")}, light on {fixed(100 * light_share, 0, "%")}
        </span>
        {"price_summary" in choice && <span class="price-words">{choice.price_summary}</span>}
      </figcaption>
    </figure>
  );
}

/** The error that a plan predicts of each pixel, before it is captured, and the region that it is for. */
export function PlannedMap() {
  const pixels = useSignal("0 0 1 1");
  const { mapped, looked } = useStore().accuracy;
  if (mapped.value === null || looked.value !== mapped.value.plan) return null;
  const corners = mapped.value.plan.region;
  const target_m = mapped.value.plan.predicted.within?.target_m;
  const middle = target_m == null ? "bright the worst" : `the middle colour ${engineering(target_m, "m", 2)}`;
  return (
    <figure class="planned-map" data-field="planned_map">
      <div class="planned-picture">
        <img
          src={mapped.value.url}
          alt="Predicted error of each pixel"
          onLoad={({ currentTarget: { naturalWidth, naturalHeight } }) => (pixels.value = `0 0 ${naturalWidth} ${naturalHeight}`)}
        />
        {corners != null && (
          <svg class="cover mark-polygon" viewBox={pixels.value} aria-hidden="true">
            <polygon data-field="planned_region" points={corners.map(([x, y]) => `${x + 0.5},${y + 0.5}`).join(" ")} />
          </svg>
        )}
      </div>
      <figcaption class="small quiet">
        Predicted error of each pixel: dark is 0, {middle}.{corners != null && " The plan is for the outlined region."}
      </figcaption>
    </figure>
  );
}
