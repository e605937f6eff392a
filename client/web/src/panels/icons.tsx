// Icons of the page, drawn on a 16 by 16 grid in the colour of the text around them.
import type { JSX } from "preact";

const SHAPES = {
  play: <path d="M4.5 2.8v10.4L13 8z" fill="currentColor" stroke="none" />,
  pause: <path d="M4 3h3v10H4zM9 3h3v10H9z" fill="currentColor" stroke="none" />,
  step: <path d="M3 3v10l7-5zM11 3h2v10h-2z" fill="currentColor" stroke="none" />,
  back: <path d="M13 3v10L6 8zM5 3H3v10h2z" fill="currentColor" stroke="none" />,
  record: <circle cx="8" cy="8" r="4.5" fill="currentColor" stroke="none" />,
  stop: <path d="M4 4h8v8H4z" fill="currentColor" stroke="none" />,
  film: <path d="M2.5 3.5h11v9h-11zM5.2 3.5v9M10.8 3.5v9M2.5 6.5h2.7M2.5 9.5h2.7M10.8 6.5h2.7M10.8 9.5h2.7" />,
  constraints: <path d="M6.7 9.3l2.6-2.6M7.5 4.8l1.4-1.4a2.6 2.6 0 0 1 3.7 3.7l-1.4 1.4M8.5 11.2l-1.4 1.4a2.6 2.6 0 0 1-3.7-3.7l1.4-1.4" />,
  markers: <path d="M2.5 13.5l2.8-.7 7.6-7.6-2.1-2.1-7.6 7.6zM9.3 4.6l2.1 2.1" />,
  reset: <path d="M3.2 8a4.9 4.9 0 1 0 1.5-3.5M3 2.5v3h3" />,
  fit: <path d="M2.5 6V2.5H6M10 2.5h3.5V6M13.5 10v3.5H10M6 13.5H2.5V10M6 6h4v4H6z" />,
  visuals: <path d="M1.5 8S4 3.8 8 3.8 14.5 8 14.5 8 12 12.2 8 12.2 1.5 8 1.5 8zM8 6.2a1.8 1.8 0 1 1 0 3.6 1.8 1.8 0 0 1 0-3.6z" />,
  collisions: <path d="M8 1.8l5.5 3v6.4l-5.5 3-5.5-3V4.8zM2.5 4.8L8 8l5.5-3.2M8 8v6.2" />,
  frames: <path d="M5 11V2.5M3.3 4.2L5 2.5l1.7 1.7M5 11h8.5M11.8 9.3L13.5 11l-1.7 1.7M5 11l-2.8 2.8" />,
  grid: <path d="M2.5 2.5h11v11h-11zM2.5 6.2h11M2.5 9.8h11M6.2 2.5v11M9.8 2.5v11" />,
  camera: <path d="M2 5h2.8l1-1.7h4.4l1 1.7H14v8H2zM8 6.6a2.3 2.3 0 1 1 0 4.6 2.3 2.3 0 0 1 0-4.6z" />,
  names: <path d="M2 3.5h7.5l4 4.5-4 4.5H2zM4.5 8h4" />,
  axes: <path d="M8 1.8v12.4M3.5 8c0-1.2 2-2.2 4.5-2.2s4.5 1 4.5 2.2-2 2.2-4.5 2.2c-.8 0-1.5-.1-2.2-.3M7 8.6l-1.4 1.3L7 11.2" />,
  masses: <path d="M8 2.2a5.8 5.8 0 1 1 0 11.6A5.8 5.8 0 0 1 8 2.2zM8 2.2v11.6M2.2 8h11.6" />,
  points: <path d="M2.5 8h.1M5 4.2h.1M8.5 2.6h.1M12 4.6h.1M13.5 8h.1M11.4 11.6h.1M5.4 11.4h.1M8 8h.1" stroke-width="2.2" />,
  inertias: <path d="M8 4.6c3.4 0 6.2 1.5 6.2 3.4S11.4 11.4 8 11.4 1.8 9.9 1.8 8 4.6 4.6 8 4.6zM8 4.6c1.1 0 2 1.5 2 3.4s-.9 3.4-2 3.4-2-1.5-2-3.4.9-3.4 2-3.4z" />,
  contacts: <path d="M1.5 12.5h13M8 12.2V4M5.5 6.5L8 4l2.5 2.5" />,
  plots: <path d="M2.5 2.5v11h11M4.8 10.5l2.7-4 2.2 2.5 3.3-5" />,
  panel: <path d="M2.5 3h11v10h-11zM10 3v10" />,
  system: <path d="M8 2.5a5.5 5.5 0 1 0 0 11zM8 2.5a5.5 5.5 0 0 1 0 11" />,
  light: <path d="M8 5.2a2.8 2.8 0 1 1 0 5.6 2.8 2.8 0 0 1 0-5.6zM8 1.3v1.5M8 13.2v1.5M1.3 8h1.5M13.2 8h1.5M3.3 3.3l1 1M11.7 11.7l1 1M3.3 12.7l1-1M11.7 4.3l1-1" />,
  dark: <path d="M13 9.6A5.5 5.5 0 0 1 6.4 3 5.5 5.5 0 1 0 13 9.6z" />,
  close: <path d="M4 4l8 8M12 4l-8 8" />,
  plus: <path d="M8 3v10M3 8h10" />,
  chevron: <path d="M4 6l4 4 4-4" />,
  remove: <path d="M3 4.5h10M6.5 4.5V3h3v1.5M4.5 4.5l.6 8.5h5.8l.6-8.5M6.8 7v3.8M9.2 7v3.8" />,
  download: <path d="M8 2.5v7.5M5 7.3L8 10.3l3-3M3 13.2h10" />,
  people: <path d="M6 3.2a2.3 2.3 0 1 1 0 4.6 2.3 2.3 0 0 1 0-4.6zM1.8 13c0-2.5 1.9-4 4.2-4s4.2 1.5 4.2 4M10.5 3.6a2 2 0 0 1 0 3.9M11.8 9.3c1.5.5 2.5 1.8 2.5 3.7" />,
  warning: <path d="M8 2.3l6.2 11H1.8zM8 6.5v3.3M8 11.3v.5" />,
  folder: <path d="M1.8 12.8V3.5h4.4l1.5 1.7h6.5v7.6z" />,
  file: <path d="M3.8 1.8h5.4l3 3v9.4H3.8zM9 2v3h3" />,
  lock: <path d="M3.8 7h8.4v6.3H3.8zM5.5 7V5a2.5 2.5 0 0 1 5 0v2" />,
  unlocked: <path d="M3.8 7h8.4v6.3H3.8zM5.5 7V4.6a2.5 2.5 0 0 1 4.9-.7" />,
  copy: <path d="M5.5 5.5h8v8h-8zM3.5 10.5h-1v-8h8v1" />,
  undo: <path d="M6 3L2.8 6.2 6 9.4M3 6.2h6.4a3.4 3.4 0 0 1 0 6.8H6" />,
  redo: <path d="M10 3l3.2 3.2L10 9.4M13 6.2H6.6a3.4 3.4 0 0 0 0 6.8H10" />,
  ground: <path d="M1.6 13.2l3.2-4h9.6l-3.2 4zM8.2 1.6v5M5.7 4.1h5" />,
  build: <path d="M13.6 4.6l-2 2-2.2-.6-.6-2.2 2-2a3.4 3.4 0 0 0-4.4 4.4L2.2 10.4a1.6 1.6 0 0 0 2.3 2.3l4.2-4.2a3.4 3.4 0 0 0 4.9-3.9z" />,
  saved: <path d="M4 2.2h8v11.6l-4-3-4 3z" />,
  info: <path d="M8 2.2a5.8 5.8 0 1 1 0 11.6A5.8 5.8 0 0 1 8 2.2zM8 7.3v3.7M8 4.9v.5" />,
} as const satisfies Record<string, JSX.Element>;

/** The name of an icon. */
export type IconName = keyof typeof SHAPES;

/** An icon; the button around it states its meaning. */
export function Icon({ name }: { name: IconName }): JSX.Element {
  return (
    <svg class="icon" viewBox="0 0 16 16" width="16" height="16" aria-hidden="true" fill="none" stroke="currentColor" stroke-width="1.4" stroke-linecap="round" stroke-linejoin="round">
      {SHAPES[name]}
    </svg>
  );
}
