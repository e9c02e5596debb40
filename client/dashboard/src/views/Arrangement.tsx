import { useComputed } from "@preact/signals";
import { Fragment } from "preact";
import { useRef } from "preact/hooks";
import { below, beside, closed, isStack, type Layout, type Row, replaced, type Slot, split, viewsOf } from "../store/layout";
import { type Store, useStore } from "../store/store";
import type { ActionGroup } from "../ui/ActionMenu";
import { DRAGGED, Panel, SlotContext } from "../ui/Panel";
import { VIEWS } from "./registry";
import "./Arrangement.css";

/** The views in their places, with splitters between them. */
export function Arrangement() {
  const store = useStore();
  const layout = store.layout.value;
  const alone = store.alone.value;
  const rows: Layout = alone === null ? layout : [{ share: 1, slots: [{ view: alone, share: 1 }] }];
  const aspect = useComputed(() => aspectOf(store)).value;
  return (
    <main class="views column" data-alone={alone !== null} style={{ "--aspect": aspect }}>
      <Parts kind="rows" parts={rows} onChange={(made) => (store.layout.value = made as Layout)} />
    </main>
  );
}

/** Width of the light's picture over its height; the paper's sensor's before there is one. */
function aspectOf({ frames }: Store): number {
  const { width, height } = frames.of("coefficients").value?.coefficients ?? { width: 163, height: 120 };
  return width / height;
}

interface PartsProps {
  /** Whether they stand one below the other or beside each other. */
  readonly kind: "rows" | "columns";
  readonly parts: readonly (Slot | Row)[];
  readonly onChange: (parts: readonly (Slot | Row)[]) => void;
}

/** The rows of a layout, the places of a row or the panels of a stack, with splitters between them. */
function Parts({ kind, parts, onChange }: PartsProps) {
  return parts.map((part, at) => (
    <Fragment key={isStack(part) ? at : part.view}>
      {at > 0 && (
        <Splitter
          kind={kind}
          place={parts[at - 1].share / (parts[at - 1].share + part.share)}
          onMove={(place) => onChange(split(parts, at - 1, place))}
        />
      )}
      {isStack(part) ? (
        <div class={kind === "rows" ? "views-row column" : "views-stack column"} style={{ "--share": part.share }}>
          <Parts
            kind={kind === "rows" ? "columns" : "rows"}
            parts={part.slots}
            onChange={(slots) => onChange(parts.map((each, n) => (n === at ? ({ ...part, slots } as Row) : each)))}
          />
        </div>
      ) : (
        <Place {...part} />
      )}
    </Fragment>
  ));
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
  const adding = (title: string, sign: string, made: typeof beside): ActionGroup => {
    const room = free.filter(({ name }) => made(layout, view, name) !== null);
    return { title, actions: room.map((each) => ({ text: `${each.title} ${sign}`, run: set(made(layout, view, each.name)) })) };
  };
  const groups = [
    {
      title: "Show here",
      actions: VIEWS.filter(({ name }) => name !== view).map(({ name, title }) => ({
        text: title,
        run: store.alone.value === null ? set(replaced(layout, view, name)) : () => (store.alone.value = name),
      })),
    },
    adding("Add to the right", "→", beside),
    adding("Add below", "↓", below),
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
      <SlotContext.Provider value={{ name: view, title: shown.title, groups }}>
        {obstacle === undefined ? <View /> : <AbsentView reason={obstacle} />}
      </SlotContext.Provider>
    </div>
  );
}

/** In the place of a view that this camera's frames have nothing for. */
function AbsentView({ reason }: { reason: string }) {
  return (
    <Panel>
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
