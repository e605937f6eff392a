// A button that opens a popover below itself: the browser closes it on Escape and on a press elsewhere.
import type { ComponentChildren, JSX } from "preact";
import { useEffect, useId, useRef, useState } from "preact/hooks";

interface Properties {
  /** The content of the button. */
  face: ComponentChildren;
  /** The tooltip of the button. */
  title: string;
  /** The accessible name, if the content is only an icon. */
  label?: string;
  class?: string;
  testId?: string;
  disabled?: boolean;
  /** Rendered only while it is open. */
  children: (close: () => void) => ComponentChildren;
}

/** The button and its popover. */
export function Popover({ face, title, label, class: className, testId, disabled = false, children }: Properties): JSX.Element {
  const id = useId();
  const button = useRef<HTMLButtonElement>(null);
  const sheet = useRef<HTMLDivElement>(null);
  const [open, setOpen] = useState(false);
  /** Places it below the button, or above if space is short, and within the window. */
  const position = (): void => {
    if (!button.current || !sheet.current) return;
    const under = button.current.getBoundingClientRect();
    const { style, offsetHeight } = sheet.current;
    const below = under.bottom + 6;
    const lowest = innerHeight - offsetHeight - 8;
    style.top = `${below <= lowest ? below : Math.max(8, Math.min(lowest, under.top - offsetHeight - 6))}px`;
    style.right = `${Math.max(8, Math.min(innerWidth - under.right, innerWidth - sheet.current.offsetWidth - 8))}px`;
  };
  // Its content may be loaded after it was opened.
  useEffect(() => {
    if (!open || !sheet.current) return undefined;
    const size = new ResizeObserver(position);
    size.observe(sheet.current);
    return () => size.disconnect();
  }, [open]);
  return (
    <>
      <button
        ref={button}
        type="button"
        class={className ?? "button"}
        title={title}
        aria-label={label}
        disabled={disabled}
        aria-expanded={open}
        popovertarget={id}
        data-testid={testId}
      >
        {face}
      </button>
      <div
        ref={sheet}
        id={id}
        popover="auto"
        class="popover"
        onBeforeToggle={(event) => {
          // Rendered before it is painted, and positioned once it has a size.
          setOpen(event.newState === "open");
          if (event.newState === "open") requestAnimationFrame(position);
        }}
      >
        {open && children(() => sheet.current?.hidePopover())}
      </div>
    </>
  );
}
