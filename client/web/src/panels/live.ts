// What changes with every state of the world, written to the page past the component tree: rows in view only.
import { effect } from "@preact/signals";
import { frame, type JointValues } from "../state/world";

/** Shows one joint's values. */
export interface Follower {
  /** Whose values it shows. */
  robot: string;
  /** The element that has to be in view. */
  element: HTMLElement;
  update(values: JointValues): void;
}

const followers = new Map<Element, Follower>();
const inView = new Set<Follower>();

const observer = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    const follower = followers.get(target);
    if (!follower) continue;
    if (isIntersecting) {
      inView.add(follower);
      show(follower);
    } else {
      inView.delete(follower);
    }
  }
});

/** Shows the newest values from now on, until the answer is called. */
export function follow(follower: Follower): () => void {
  followers.set(follower.element, follower);
  observer.observe(follower.element);
  show(follower);
  return () => {
    followers.delete(follower.element);
    inView.delete(follower);
    observer.unobserve(follower.element);
  };
}

/** Shows the newest values once more: for what changed besides the world. */
export function show(follower: Follower): void {
  const values = frame.peek()?.joints.get(follower.robot);
  if (values) follower.update(values);
}

effect(() => {
  const joints = frame.value?.joints;
  if (!joints) return;
  for (const follower of inView) {
    const values = joints.get(follower.robot);
    if (values) follower.update(values);
  }
});
