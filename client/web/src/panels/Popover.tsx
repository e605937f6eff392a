// A button that opens a small sheet under itself: the browser closes it on Escape and on a press elsewhere.
import type { ComponentChildren, JSX } from "preact";
import { useId, useRef, useState } from "preact/hooks";

interface Properties {
  /** What is on the button. */
  face: ComponentChildren;
  /** For people who point at the button. */
  title: string;
  /** Read out in place of the face, where that is only a sign. */
  label?: string;
  class?: string;
  testId?: string;
  /** Nothing of it is made until it opens. */
  children: (close: () => void) => ComponentChildren;
}

/** The button and its sheet. */
export function Popover({ face, title, label, class: className, testId, children }: Properties): JSX.Element {
  const id = useId();
  const button = useRef<HTMLButtonElement>(null);
  const sheet = useRef<HTMLDivElement>(null);
  const [open, setOpen] = useState(false);
  /** Under the button, and within the window. */
  const place = (): void => {
    if (!button.current || !sheet.current) return;
    const under = button.current.getBoundingClientRect();
    const { style } = sheet.current;
    style.top = `${under.bottom + 6}px`;
    style.right = `${Math.max(8, Math.min(innerWidth - under.right, innerWidth - sheet.current.offsetWidth - 8))}px`;
  };
  return (
    <>
      <button
        ref={button}
        type="button"
        class={className ?? "button"}
        title={title}
        aria-label={label}
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
          // Made before it is painted, and placed once it has a size.
          setOpen(event.newState === "open");
          if (event.newState === "open") requestAnimationFrame(place);
        }}
      >
        {open && children(() => sheet.current?.hidePopover())}
      </div>
    </>
  );
}
