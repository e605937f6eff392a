// The links of a robot as a tree, with the joint of each: masses, inertias, axes, limits, and findings of the load
// report.
import { signal, useComputed, useSignalEffect } from "@preact/signals";
import type { JSX } from "preact";
import { useEffect, useRef, useState } from "preact/hooks";
import { actuatorOf, type Actuator } from "../daemon/actuators";
import { reports, type Finding } from "../state/report";
import { scenes, type Geometry, type RobotScene, type SceneJoint, type SceneLink, type Shape } from "../state/scene";
import { degrees, hoveredLink } from "../state/view";
import type { Robot } from "../state/world";
import { matches } from "./groups";
import { Icon } from "./icons";
import { shortened, unitOf } from "./quantity";
import { depthsOf, findingsOf, isTurning } from "./tree";

const filter = signal("");

/** Maximum number of listed shapes of a link. */
const MOST_LOOKS = 12;

/** The tree of one robot. */
export function Structure({ robot }: { robot: Robot }): JSX.Element {
  const scene = useComputed(() => scenes.value.get(robot.name)).value;
  const findings = useComputed(() => reports.value.get(robot.name)?.findings ?? []).value;
  if (!scene) return <p class="hint">The structure of {robot.name} is on its way.</p>;
  const joints = new Map((scene.joints ?? []).map((joint) => [joint.child, joint]));
  const depths = depthsOf(scene.links);
  const shown = scene.links.flatMap((link, index) => {
    const joint = joints.get(link.name);
    return matches(`${link.name} ${joint?.name ?? ""}`, filter.value) ? [{ link, joint, depth: depths[index] ?? 0 }] : [];
  });
  return (
    <section class="structure" aria-label={`Structure of ${robot.name}`} data-testid="structure">
      <Totals scene={scene} />
      <input
        type="search"
        class="filter"
        placeholder="Filter links and joints"
        aria-label="Filter links and joints"
        data-testid="structure-filter"
        autocomplete="off"
        spellcheck={false}
        value={filter}
        onInput={(event) => {
          filter.value = event.currentTarget.value;
        }}
      />
      {shown.length === 0 && <p class="hint">No link or joint of {robot.name} has “{filter}” in its name.</p>}
      <ul class="tree">
        {shown.map(({ link, joint, depth }) => (
          <Row key={link.name} scene={scene} link={link} joint={joint} depth={filter.value.trim() === "" ? depth : 0} findings={findingsOf(findings, link.name, joint?.name)} />
        ))}
      </ul>
    </section>
  );
}

function Totals({ scene: { links, joints } }: { scene: RobotScene }): JSX.Element {
  const mass = links.reduce((sum, link) => sum + link.mass, 0);
  const fixed = joints?.filter(({ type }) => type === "fixed").length ?? 0;
  const moving = (joints?.length ?? 0) - fixed;
  return (
    <p class="hint" data-testid="structure-totals">
      {counted(links.length, "link")} · {shortened(mass)} kg · {counted(moving, "moving joint")} · {counted(fixed, "fixed joint")}
    </p>
  );
}

function counted(count: number, what: string): string {
  return `${count} ${what}${count === 1 ? "" : "s"}`;
}

interface RowProperties {
  scene: RobotScene;
  link: SceneLink;
  joint: SceneJoint | undefined;
  depth: number;
  findings: readonly Finding[];
}

function Row({ scene, link, joint, depth, findings }: RowProperties): JSX.Element {
  const { robot } = scene;
  const row = useRef<HTMLLIElement>(null);
  const [isOpen, setOpen] = useState(false);
  useSignalEffect(() => {
    const lit = hoveredLink.value;
    row.current?.toggleAttribute("data-lit", lit?.robot === robot && lit.link === link.name);
  });
  const hover = (on: boolean) => () => {
    hoveredLink.value = on ? { robot, link: link.name } : null;
  };
  return (
    <li ref={row} data-testid={`link-${link.name}`} style={{ "--depth": String(Math.min(depth, 12)) }} onPointerEnter={hover(true)} onPointerLeave={hover(false)}>
      <details onToggle={(event) => setOpen(event.currentTarget.open)}>
        <summary onFocus={hover(true)} onBlur={hover(false)}>
          <Icon name="chevron" />
          <span class="tree-name" title={link.name}>
            {link.name}
          </span>
          {findings.length > 0 && <span class="count">{findings.length}</span>}
          <span class="hint tree-joint" title={joint ? `Joint ${joint.name}` : "The root"}>
            {joint ? joint.type : "root"}
          </span>
          <span class="tabular tree-mass">{shortened(link.mass)} kg</span>
        </summary>
        <dl class="facts">
          {joint && <JointFacts joint={joint} />}
          {isOpen && joint && joint.type !== "fixed" && <ActuatorFacts robot={robot} joint={joint} />}
          {link.centreOfMass && <Fact term="centre of mass" text={`${vectorText(link.centreOfMass)} m`} />}
          {link.inertia?.length === 6 && <InertiaFacts inertia={link.inertia} />}
          <LookFacts scene={scene} link={link} />
          {findings.map(({ severity, message }, index) => (
            <Fact key={index} term={severity} text={message} />
          ))}
        </dl>
      </details>
    </li>
  );
}

function JointFacts({ joint }: { joint: SceneJoint }): JSX.Element {
  const { name, type, axis, lower, upper, effort, velocity, damping, friction, mimics, pulls } = joint;
  const kind = isTurning(type) ? "angle" : "length";
  const position = unitOf(kind, "position", degrees.value);
  const speed = unitOf(kind, "velocity", degrees.value);
  const force = unitOf(kind, "effort", degrees.value).name;
  const bound = (value: number | undefined, open: string): string => (value === undefined ? open : shortened(value / position.scale));
  return (
    <>
      <Fact term="joint" text={`${name} (${type})`} />
      {axis && <Fact term="axis" text={vectorText(axis)} />}
      {(lower !== undefined || upper !== undefined) && <Fact term="limits" text={`${bound(lower, "–∞")} to ${bound(upper, "∞")} ${position.name}`} />}
      {velocity !== undefined && <Fact term="velocity" text={`at most ${shortened(velocity / speed.scale)} ${speed.name}`} />}
      {effort !== undefined && <Fact term="effort" text={`at most ${shortened(effort)} ${force}`} />}
      {damping > 0 && <Fact term="damping" text={`${shortened(damping)} ${kind === "angle" ? "N m s/rad" : "N s/m"}`} />}
      {friction > 0 && <Fact term="dry friction" text={`${shortened(friction)} ${force}`} />}
      {mimics !== undefined && <Fact term="follows" text={mimics} />}
      {pulls !== undefined && <Fact term="tendon of" text={pulls.join(", ")} />}
    </>
  );
}

/** Gains of a joint at the time when its row is opened: clients may change them. */
function ActuatorFacts({ robot, joint }: { robot: string; joint: SceneJoint }): JSX.Element | null {
  const [actuator, setActuator] = useState<Actuator>();
  useEffect(() => {
    let isGone = false;
    void actuatorOf(robot, joint.name).then((found) => {
      if (!isGone) setActuator(found);
    });
    return () => {
      isGone = true;
    };
  }, [robot, joint.name]);
  if (!actuator) return null;
  const { stiffness, damping, armature, gravityCompensation } = actuator;
  const [spring, damper, rotor] = isTurning(joint.type) ? ["N m/rad", "N m s/rad", "kg m²"] : ["N/m", "N s/m", "kg"];
  return (
    <>
      {stiffness !== undefined && <Fact term="gains" text={`${shortened(stiffness)} ${spring}, ${shortened(damping ?? 0)} ${damper}`} />}
      {armature > 0 && <Fact term="rotor" text={`${shortened(armature)} ${rotor}`} />}
      {actuator.spring !== undefined && <Fact term="spring" text={`${shortened(actuator.spring)} ${spring}`} />}
      {gravityCompensation && <Fact term="gravity" text="its actuator holds the weight" />}
    </>
  );
}

/** Appearance of a link, and its collision shapes. */
function LookFacts({ scene, link }: { scene: RobotScene; link: SceneLink }): JSX.Element {
  const index = scene.links.indexOf(link);
  const looks = scene.visuals.filter((shape) => shape.link === index);
  const touching = scene.colliders.filter((shape) => shape.link === index).map(({ geometry }) => shapeWords(geometry));
  const counts = [...new Set(touching)].map((words) => {
    const count = touching.filter((each) => each === words).length;
    return count > 1 ? `${count} × ${words}` : words;
  });
  return (
    <>
      {looks.slice(0, MOST_LOOKS).map((shape, lookIndex) => (
        <div key={lookIndex}>
          <dt>looks</dt>
          <dd class="tabular">
            {shapeWords(shape.geometry)} <Paint shape={shape} />
          </dd>
        </div>
      ))}
      {looks.length > MOST_LOOKS && <Fact term="looks" text={`and ${looks.length - MOST_LOOKS} more`} />}
      {counts.length > 0 && <Fact term="touches with" text={counts.join(", ")} />}
    </>
  );
}

/** A colour with its name on the web, and a note if it has a picture. */
function Paint({ shape: { color, texture, textureRepeat, geometry } }: { shape: Shape }): JSX.Element {
  const hex = color && `#${color.slice(0, 3).map((part) => Math.round(255 * part).toString(16).padStart(2, "0")).join("")}`;
  const alpha = color && color[3] < 1 ? `, ${Math.round(100 * color[3])} % opaque` : "";
  const picture = texture === undefined ? "" : textureRepeat ? `picture, ${shortened(textureRepeat.x)} × ${shortened(textureRepeat.y)}${textureRepeat.perMetre ? " a metre" : ""}` : "picture";
  const own = hex === undefined && picture === "" && geometry.kind === "mesh" ? "materials of its file" : "";
  return (
    <>
      {hex !== undefined && <span class="swatch" style={{ background: hex }} aria-hidden="true" />}
      {[hex === undefined ? "" : `${hex}${alpha}`, picture, own].filter((part) => part !== "").join(", ")}
    </>
  );
}

function shapeWords(geometry: Geometry): string {
  switch (geometry.kind) {
    case "box":
      return `box ${geometry.size.map(shortened).join(" × ")} m`;
    case "sphere":
      return `sphere of ${shortened(geometry.radius)} m`;
    case "cylinder":
    case "capsule":
    case "cone":
      return `${geometry.kind} of ${shortened(geometry.radius)} m, ${shortened(geometry.length)} m long`;
    case "plane":
      return "plane";
    case "mesh":
      return `mesh ${geometry.uri.split(/[/\\]/).at(-1) ?? ""}${geometry.sha256 === "" ? " (missing)" : ""}`;
    case "convex":
      return "convex shape";
  }
}

function InertiaFacts({ inertia }: { inertia: readonly number[] }): JSX.Element {
  const [xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0] = inertia;
  const off = [xy, xz, yz].some((value) => value !== 0);
  return (
    <>
      <Fact term="inertia xx yy zz" text={`${vectorText([xx, yy, zz])} kg m²`} />
      {off && <Fact term="inertia xy xz yz" text={`${vectorText([xy, xz, yz])} kg m²`} />}
    </>
  );
}

function Fact({ term, text }: { term: string; text: string }): JSX.Element {
  return (
    <div>
      <dt>{term}</dt>
      <dd class="tabular">{text}</dd>
    </div>
  );
}

function vectorText(values: readonly number[]): string {
  return values.map(shortened).join(" ");
}
