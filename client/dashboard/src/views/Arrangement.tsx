import { useComputed } from "@preact/signals";
import { Fragment } from "preact";
import { useRef } from "preact/hooks";
import { below, beside, closed, isStack, type Layout, type Row, replaced, type Slot, type Stack, split, viewsOf } from "../store/layout";
import { type Store, useStore } from "../store/store";
import { DRAGGED, Panel, SlotContext } from "../ui/Panel";
import { VIEWS } from "./registry";
import "./Arrangement.css";

/** The views in their places, with splitters between them. */
export function Arrangement() {
  const store = useStore();
  const layout = store.layout.value;
  const alone = store.alone.value;
  const rows: Layout = alone === null ? layout : [{ share: 1, slots: [{ view: alone, share: 1 }] }];
  const change = (made: Layout): void => {
    store.layout.value = made;
  };
  const aspect = useComputed(() => aspectOf(store)).value;
  return (
    <main class="views" data-alone={alone !== null} style={{ "--aspect": aspect }}>
      {rows.map((row, at) => (
        <Fragment key={at}>
          {at > 0 && (
            <Splitter
              kind="rows"
              place={rows[at - 1].share / (rows[at - 1].share + row.share)}
              onMove={(place) => change(split(rows, at - 1, place))}
            />
          )}
          <RowOfViews row={row} onChange={(made) => change(rows.map((each, n) => (n === at ? made : each)))} />
        </Fragment>
      ))}
    </main>
  );
}

/** Width of the light's picture over its height; the paper's sensor's before there is one. */
function aspectOf({ frames }: Store): number {
  const { width, height } = frames.of("coefficients").value?.coefficients ?? { width: 163, height: 120 };
  return width / height;
}

function RowOfViews({ row, onChange }: { row: Row; onChange: (row: Row) => void }) {
  return (
    <div class="views-row" style={{ "--share": row.share }}>
      {row.slots.map((place, at) => (
        <Fragment key={isStack(place) ? `stack ${at}` : place.view}>
          {at > 0 && (
            <Splitter
              kind="columns"
              place={row.slots[at - 1].share / (row.slots[at - 1].share + place.share)}
              onMove={(share) => onChange({ ...row, slots: split(row.slots, at - 1, share) })}
            />
          )}
          {isStack(place) ? (
            <StackOfViews
              stack={place}
              onChange={(made) => onChange({ ...row, slots: row.slots.map((each, n) => (n === at ? made : each)) })}
            />
          ) : (
            <Place {...place} />
          )}
        </Fragment>
      ))}
    </div>
  );
}

function StackOfViews({ stack, onChange }: { stack: Stack; onChange: (stack: Stack) => void }) {
  const { slots } = stack;
  return (
    <div class="views-stack" style={{ "--share": stack.share }}>
      {slots.map((slot, at) => (
        <Fragment key={slot.view}>
          {at > 0 && (
            <Splitter
              kind="rows"
              place={slots[at - 1].share / (slots[at - 1].share + slot.share)}
              onMove={(share) => onChange({ ...stack, slots: split(slots, at - 1, share) })}
            />
          )}
          <Place {...slot} />
        </Fragment>
      ))}
    </div>
  );
}

/** A view and what its panel may do with its place. */
function Place({ view, share }: Slot) {
  const store = useStore();
  const shown = VIEWS.find(({ name }) => name === view);
  if (shown === undefined) return null;
  const View = shown.view;
  const obstacle = shown.needs === undefined ? undefined : store.frames.absent.value[shown.needs];
  const layout = store.layout.value;
  const set = (made: Layout | null) => (): void => {
    if (made !== null) store.layout.value = made;
    store.alone.value = null;
  };
  const free = VIEWS.filter(({ name }) => !viewsOf(layout).includes(name));
  const room = (made: (wanted: string) => Layout | null) => free.filter(({ name }) => made(name) !== null);
  const groups = [
    {
      title: "Show here",
      actions: VIEWS.filter(({ name }) => name !== view).map(({ name, title }) => ({
        text: title,
        run: store.alone.value === null ? set(replaced(layout, view, name)) : () => (store.alone.value = name),
      })),
    },
    {
      title: "Add to the right",
      actions: room((name) => beside(layout, view, name)).map(({ name, title }) => ({
        text: `${title} →`,
        run: set(beside(layout, view, name)),
      })),
    },
    {
      title: "Add below",
      actions: room((name) => below(layout, view, name)).map(({ name, title }) => ({
        text: `${title} ↓`,
        run: set(below(layout, view, name)),
      })),
    },
    {
      title: "Panel",
      actions: [
        {
          text: store.alone.value === view ? "Show all panels" : "Show alone",
          run: () => (store.alone.value = store.alone.peek() === view ? null : view),
        },
        ...(viewsOf(layout).length > 1 ? [{ text: "Close", run: set(closed(layout, view)) }] : []),
      ],
    },
  ];
  return (
    <div
      class="place"
      data-place={view}
      style={{ "--share": share }}
      onDragOver={(event) => {
        if (event.dataTransfer?.types.includes(DRAGGED)) event.preventDefault();
      }}
      onDrop={(event) => {
        const dragged = event.dataTransfer?.getData(DRAGGED) ?? "";
        if (!viewsOf(layout).includes(dragged) || dragged === view) return;
        event.preventDefault();
        set(replaced(layout, view, dragged))();
      }}
    >
      <SlotContext.Provider value={groups}>
        {obstacle === undefined ? <View /> : <AbsentView name={view} title={shown.title} reason={obstacle} />}
      </SlotContext.Provider>
    </div>
  );
}

/** In the place of a view that this camera's frames have nothing for. */
function AbsentView({ name, title, reason }: { name: string; title: string; reason: string }) {
  return (
    <Panel name={name} title={<h2>{title}</h2>}>
      <p class="absent" data-field="absent">
        This camera cannot show it: {reason}.
      </p>
    </Panel>
  );
}

/** Moved by pointer and arrow keys. */
const KEY_STEP = 0.02;

function Splitter({ kind, place, onMove }: { kind: "rows" | "columns"; place: number; onMove: (place: number) => void }) {
  const bar = useRef<HTMLDivElement>(null);
  const across = kind === "columns";
  const placeOf = (event: PointerEvent): number => {
    const [before, after] = [bar.current?.previousElementSibling, bar.current?.nextElementSibling].map((each) =>
      each?.getBoundingClientRect(),
    );
    if (before === undefined || after === undefined) return place;
    return across
      ? (event.clientX - before.left) / (after.right - before.left)
      : (event.clientY - before.top) / (after.bottom - before.top);
  };
  const keys: Readonly<Record<string, number | undefined>> = across
    ? { ArrowLeft: -KEY_STEP, ArrowRight: KEY_STEP }
    : { ArrowUp: -KEY_STEP, ArrowDown: KEY_STEP };
  return (
    <div
      ref={bar}
      class={`splitter splitter-${kind}`}
      role="separator"
      aria-orientation={across ? "vertical" : "horizontal"}
      aria-label={across ? "Width of the panels" : "Height of the panels"}
      aria-valuenow={Math.round(100 * place)}
      tabIndex={0}
      onPointerDown={(event) => {
        if (event.button === 0) event.currentTarget.setPointerCapture(event.pointerId);
      }}
      onPointerMove={(event) => {
        if (event.currentTarget.hasPointerCapture(event.pointerId)) onMove(placeOf(event));
      }}
      onKeyDown={(event) => {
        const step = keys[event.key];
        if (step === undefined) return;
        event.preventDefault();
        event.stopPropagation();
        onMove(place + step);
      }}
      onDblClick={() => onMove(0.5)}
    />
  );
}
