/** Places of what opens over the page. */

/** Least distance between what opens and the edge of the window, in CSS px. */
const EDGE_PX = 8;
const GAP_PX = 4;

/** Puts an open popover below its button, or above where there is more room; within the window. */
export function placeBeside(popover: HTMLElement, button: HTMLElement): void {
  const from = button.getBoundingClientRect();
  const { innerWidth, innerHeight } = window;
  const above = innerHeight - from.bottom < popover.scrollHeight && from.top > innerHeight - from.bottom;
  popover.style.maxHeight = `${(above ? from.top : innerHeight - from.bottom) - 2 * EDGE_PX}px`;
  popover.style.left = `${Math.max(EDGE_PX, Math.min(from.right, innerWidth - EDGE_PX) - popover.offsetWidth)}px`;
  popover.style.top = `${above ? Math.max(EDGE_PX, from.top - popover.offsetHeight - GAP_PX) : from.bottom + GAP_PX}px`;
}
