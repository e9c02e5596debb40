import { engineering, fixed } from "../../scales/format";
import type { ChoiceDocument, PlanDocument, PriceDocument } from "../../stream/documents";
import "./PriceBar.css";

const ITEMS = [
  ["light_s", "light"],
  ["readout_s", "read-out"],
  ["settling_s", "settling"],
  ["transport_s", "transport"],
  ["computing_s", "computing"],
] as const satisfies readonly (readonly [keyof PriceDocument, string])[];

/** What a capture takes until its ranges are there, item by item, and what would buy most of it. */
export function PriceBar({ choice }: { choice: ChoiceDocument | PlanDocument }) {
  const { price } = choice;
  const known = ITEMS.flatMap(([field, name]) => {
    const time_s = price[field];
    return time_s == null || time_s <= 0 ? [] : [{ field, name, time_s }];
  });
  const unknown = price.computing_s == null ? " without computing, not known yet" : "";
  return (
    <figure class="price" data-field="choice_price">
      <div class="price-bar" aria-hidden="true">
        {known.map(({ field, time_s }) => (
          <i key={field} class={`price-item price-${field}`} style={{ flexGrow: time_s / price.sum_s }} />
        ))}
      </div>
      <figcaption>
        {known.map(({ field, name, time_s }) => (
          <span key={field}>
            <i class={`price-key price-${field}`} aria-hidden="true" /> {name} {engineering(time_s, "s", 2)}
          </span>
        ))}
        <span>
          sum {engineering(price.sum_s, "s", 2)}
          {unknown}
        </span>
        <span class="quiet">
          {fixed(price.data_bytes / 1e6, 2, "MB")}, light on {fixed(100 * price.light_share, 0, "%")}
        </span>
        {"price_summary" in choice && <span class="price-words">{choice.price_summary}</span>}
      </figcaption>
    </figure>
  );
}
