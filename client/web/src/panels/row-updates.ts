// Updates rows with every state of the world, outside of the component tree, and only those that are in view.
import { effect } from "@preact/signals";
import { frame, type JointValues } from "../state/world";

/** A row that shows the values of one joint. */
export interface Follower {
  /** The robot of the joint. */
  robot: string;
  /** The row is updated while this element is in view. */
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

/** Updates a row from now on, until the returned function is called. */
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

/** Updates a row now, for a change that is not part of a state. */
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
