import type { VerdictDocument } from "../../stream/documents";

/** Which pixels speak against a diffuser, in blocks. */
export function Blocks({ verdict: { blocks, block_px } }: { verdict: VerdictDocument }) {
  const [rows, columns] = [blocks.length, blocks[0]?.length ?? 0];
  if (!blocks.some((row) => row.includes("#") || row.includes("?"))) return null;
  return (
    <svg
      class="blocks"
      viewBox={`0 0 ${columns} ${rows}`}
      role="img"
      aria-label={`Blocks of ${block_px} pixels that are unlike a diffuser`}
    >
      {blocks.flatMap((row, y) =>
        [...row].map(
          (character, x) =>
            character !== "." && (
              <rect key={`${x}.${y}`} class={character === "#" ? "block-unlike" : "block-unknown"} x={x} y={y} width={1} height={1} />
            ),
        ),
      )}
    </svg>
  );
}
