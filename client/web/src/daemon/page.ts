// The one link of this page, and when it asks: while somebody can see the page.
import { Link } from "./link";
import { services } from "./services";

let ours: Link | undefined;

/** The link of this page. */
export function link(): Link {
  ours ??= new Link(services());
  return ours;
}

/** Asks the daemon from now on, while the page is not hidden. */
export function startLink(): void {
  const follow = () => link().setVisible(!document.hidden);
  document.addEventListener("visibilitychange", follow);
  window.addEventListener("online", () => link().retry());
  follow();
}

/** Tries a lost daemon now, without waiting for the countdown. */
export function retryNow(): void {
  link().retry();
}
