// Clients of the daemon's services: binary gRPC-Web, at the origin of the page.
import { createClient, type Client, type Interceptor, type Transport } from "@connectrpc/connect";
import { createGrpcWebTransport } from "@connectrpc/connect-web";
import { CameraService } from "../gen/simd/v1/camera_pb";
import { ClientService } from "../gen/simd/v1/client_pb";
import { ConstraintService } from "../gen/simd/v1/constraint_pb";
import { ContactService } from "../gen/simd/v1/contact_pb";
import { EntityService } from "../gen/simd/v1/entity_pb";
import { EventService } from "../gen/simd/v1/event_pb";
import { JointService } from "../gen/simd/v1/joint_pb";
import { ParameterService } from "../gen/simd/v1/parameter_pb";
import { RecordingService } from "../gen/simd/v1/recording_pb";
import { SensorService } from "../gen/simd/v1/sensor_pb";
import { SimulationService } from "../gen/simd/v1/simulation_pb";
import { ViewService } from "../gen/simd/v1/view_pb";
import { claimFor } from "./held-claims";
import { countRequest } from "./request-count";
import { API_VERSION } from "./version";

/** One client for each service. */
export interface Services {
  cameras: Client<typeof CameraService>;
  clients: Client<typeof ClientService>;
  constraints: Client<typeof ConstraintService>;
  contacts: Client<typeof ContactService>;
  entities: Client<typeof EntityService>;
  events: Client<typeof EventService>;
  joints: Client<typeof JointService>;
  parameters: Client<typeof ParameterService>;
  recordings: Client<typeof RecordingService>;
  sensors: Client<typeof SensorService>;
  simulation: Client<typeof SimulationService>;
  view: Client<typeof ViewService>;
}

/** Clients over any transport; tests use a router transport. */
export function servicesOver(transport: Transport): Services {
  return {
    cameras: createClient(CameraService, transport),
    clients: createClient(ClientService, transport),
    constraints: createClient(ConstraintService, transport),
    contacts: createClient(ContactService, transport),
    entities: createClient(EntityService, transport),
    events: createClient(EventService, transport),
    joints: createClient(JointService, transport),
    parameters: createClient(ParameterService, transport),
    recordings: createClient(RecordingService, transport),
    sensors: createClient(SensorService, transport),
    simulation: createClient(SimulationService, transport),
    view: createClient(ViewService, transport),
  };
}

let ours: Services | undefined;
let way: Transport | undefined;

/** Transport of this page's calls, for clients of services that most visits do not need. */
export function transport(): Transport {
  way ??= createGrpcWebTransport({ baseUrl: location.origin, useBinaryFormat: true, interceptors: [identify(tabName())] });
  return way;
}

/** The clients of this page. */
export function services(): Services {
  ours ??= servicesOver(transport());
  return ours;
}

/** Adds the name of this client, the version of the schema and this page's claim to each call. */
function identify(name: string): Interceptor {
  return (next) => (request) => {
    request.header.set("simd-api-version", API_VERSION);
    request.header.set("simd-client", name);
    countRequest();
    const message = request.message as { claim?: unknown };
    // A request for a claim carries none.
    if (!request.stream && message.claim === "" && request.method.name !== "ReleaseJoints") message.claim = claimFor(message);
    return next(request);
  };
}

/** `viewer-` and four hexadecimal digits, kept as long as the tab. */
export function tabName(): string {
  const key = "simd.client";
  try {
    const kept = sessionStorage.getItem(key);
    if (kept && /^viewer-[0-9a-f]{4}$/.test(kept)) return kept;
    const made = makeName();
    sessionStorage.setItem(key, made);
    return made;
  } catch {
    // Storage may be disabled; then the name lasts until the page is reloaded.
    return makeName();
  }
}

function makeName(): string {
  const [number = 0] = crypto.getRandomValues(new Uint16Array(1));
  return `viewer-${number.toString(16).padStart(4, "0")}`;
}
