//! How ROS 2 asks simulators for things, version 2.

use super::geometry_msgs::{Accel, Pose, PoseStamped, Twist, Vector3};
use super::std_msgs::Header;
use crate::message::{messages, services};

messages! {
    /// How a call went. Services have codes of their own above 100.
    Result = "simulation_interfaces/msg/Result" consts {
        RESULT_FEATURE_UNSUPPORTED: u8 = 0;
        RESULT_OK: u8 = 1;
        RESULT_NOT_FOUND: u8 = 2;
        RESULT_INCORRECT_STATE: u8 = 3;
        RESULT_OPERATION_FAILED: u8 = 4;
    } {
        result: u8,
        error_message: String,
    }

    /// What kind of thing an entity is.
    EntityCategory = "simulation_interfaces/msg/EntityCategory" consts {
        CATEGORY_OBJECT: u8 = 0;
        CATEGORY_ROBOT: u8 = 1;
        CATEGORY_HUMAN: u8 = 2;
        CATEGORY_DYNAMIC_OBJECT: u8 = 4;
        CATEGORY_STATIC_OBJECT: u8 = 5;
    } {
        category: u8,
    }

    /// Which tags are asked for.
    TagsFilter = "simulation_interfaces/msg/TagsFilter" consts {
        FILTER_MODE_ANY: u8 = 0;
        FILTER_MODE_ALL: u8 = 1;
    } {
        tags: Vec<String>,
        filter_mode: u8,
    }

    /// A part of space.
    Bounds = "simulation_interfaces/msg/Bounds" consts {
        TYPE_EMPTY: u8 = 0;
        TYPE_BOX: u8 = 1;
        TYPE_CONVEX_HULL: u8 = 2;
        TYPE_SPHERE: u8 = 3;
    } {
        r#type: u8,
        points: Vec<Vector3>,
    }

    /// Which entities are asked for.
    EntityFilters = "simulation_interfaces/msg/EntityFilters" {
        filter: String,
        categories: Vec<EntityCategory>,
        tags: TagsFilter,
        bounds: Bounds,
    }

    /// Where an entity is and how it moves.
    EntityState = "simulation_interfaces/msg/EntityState" {
        header: Header,
        pose: Pose,
        twist: Twist,
        acceleration: Accel,
    }

    /// A file by its address, or its text.
    Resource = "simulation_interfaces/msg/Resource" {
        uri: String,
        resource_string: String,
    }

    /// Whether the simulation goes on.
    SimulationState = "simulation_interfaces/msg/SimulationState" consts {
        STATE_STOPPED: u8 = 0;
        STATE_PLAYING: u8 = 1;
        STATE_PAUSED: u8 = 2;
        STATE_QUITTING: u8 = 3;
        STATE_NO_WORLD: u8 = 4;
        STATE_LOADING_WORLD: u8 = 5;
    } {
        state: u8,
    }

    /// What a simulator can do.
    SimulatorFeatures = "simulation_interfaces/msg/SimulatorFeatures" consts {
        SPAWNING: u8 = 0;
        DELETING: u8 = 1;
        NAMED_POSES: u8 = 2;
        POSE_BOUNDS: u8 = 3;
        ENTITY_TAGS: u8 = 4;
        ENTITY_BOUNDS: u8 = 5;
        ENTITY_BOUNDS_BOX: u8 = 6;
        ENTITY_BOUNDS_CONVEX: u8 = 7;
        ENTITY_CATEGORIES: u8 = 8;
        SPAWNING_RESOURCE_STRING: u8 = 9;
        ENTITY_STATE_GETTING: u8 = 10;
        ENTITY_STATE_SETTING: u8 = 11;
        ENTITY_INFO_GETTING: u8 = 12;
        ENTITY_INFO_SETTING: u8 = 13;
        SPAWNABLES: u8 = 14;
        SIMULATION_RESET: u8 = 20;
        SIMULATION_RESET_TIME: u8 = 21;
        SIMULATION_RESET_STATE: u8 = 22;
        SIMULATION_RESET_SPAWNED: u8 = 23;
        SIMULATION_STATE_GETTING: u8 = 24;
        SIMULATION_STATE_SETTING: u8 = 25;
        SIMULATION_STATE_PAUSE: u8 = 26;
        STEP_SIMULATION_SINGLE: u8 = 31;
        STEP_SIMULATION_MULTIPLE: u8 = 32;
        STEP_SIMULATION_ACTION: u8 = 33;
        WORLD_LOADING: u8 = 40;
        WORLD_RESOURCE_STRING: u8 = 41;
        WORLD_TAGS: u8 = 42;
        WORLD_UNLOADING: u8 = 43;
        WORLD_INFO_GETTING: u8 = 44;
        AVAILABLE_WORLDS: u8 = 45;
        SPAWNING_ENTITIES: u8 = 50;
    } {
        features: Vec<u16>,
        spawn_formats: Vec<String>,
        custom_info: String,
    }

    /// Asks for names.
    GetEntitiesRequest = "simulation_interfaces/srv/GetEntities_Request" {
        filters: EntityFilters,
    }

    /// They.
    GetEntitiesResponse = "simulation_interfaces/srv/GetEntities_Response" {
        result: Result,
        entities: Vec<String>,
    }

    /// Asks for an entity's state.
    GetEntityStateRequest = "simulation_interfaces/srv/GetEntityState_Request" {
        entity: String,
    }

    /// It.
    GetEntityStateResponse = "simulation_interfaces/srv/GetEntityState_Response" {
        result: Result,
        state: EntityState,
    }

    /// Moves an entity.
    SetEntityStateRequest = "simulation_interfaces/srv/SetEntityState_Request" {
        entity: String,
        state: EntityState,
        set_pose: bool,
        set_twist: bool,
        set_acceleration: bool,
    }

    /// How it went.
    SetEntityStateResponse = "simulation_interfaces/srv/SetEntityState_Response" consts {
        INVALID_POSE: u8 = 101;
    } {
        result: Result,
    }

    /// Asks whether the simulation goes on.
    GetSimulationStateRequest = "simulation_interfaces/srv/GetSimulationState_Request" {
    }

    /// Whether it does.
    GetSimulationStateResponse = "simulation_interfaces/srv/GetSimulationState_Response" {
        state: SimulationState,
        result: Result,
    }

    /// Makes it go on, or not.
    SetSimulationStateRequest = "simulation_interfaces/srv/SetSimulationState_Request" {
        state: SimulationState,
    }

    /// How it went.
    SetSimulationStateResponse = "simulation_interfaces/srv/SetSimulationState_Response" consts {
        ALREADY_IN_TARGET_STATE: u8 = 101;
        STATE_TRANSITION_ERROR: u8 = 102;
        INCORRECT_TRANSITION: u8 = 103;
    } {
        result: Result,
    }

    /// Goes back to the start.
    ResetSimulationRequest = "simulation_interfaces/srv/ResetSimulation_Request" consts {
        SCOPE_DEFAULT: u8 = 0;
        SCOPE_TIME: u8 = 1;
        SCOPE_STATE: u8 = 2;
        SCOPE_SPAWNED: u8 = 4;
        SCOPE_ALL: u8 = 255;
    } {
        scope: u8,
    }

    /// How it went.
    ResetSimulationResponse = "simulation_interfaces/srv/ResetSimulation_Response" {
        result: Result,
    }

    /// Takes steps of a paused simulation.
    StepSimulationRequest = "simulation_interfaces/srv/StepSimulation_Request" {
        steps: u64,
    }

    /// How it went.
    StepSimulationResponse = "simulation_interfaces/srv/StepSimulation_Response" {
        result: Result,
    }

    /// Makes an entity.
    SpawnEntityRequest = "simulation_interfaces/srv/SpawnEntity_Request" {
        name: String,
        allow_renaming: bool,
        entity_resource: Resource,
        entity_namespace: String,
        initial_pose: PoseStamped,
    }

    /// How it is called.
    SpawnEntityResponse = "simulation_interfaces/srv/SpawnEntity_Response" consts {
        NAME_NOT_UNIQUE: u8 = 101;
        NAME_INVALID: u8 = 102;
        UNSUPPORTED_FORMAT: u8 = 103;
        NO_RESOURCE: u8 = 104;
        NAMESPACE_INVALID: u8 = 105;
        RESOURCE_PARSE_ERROR: u8 = 106;
        MISSING_ASSETS: u8 = 107;
        UNSUPPORTED_ASSETS: u8 = 108;
        INVALID_POSE: u8 = 109;
    } {
        result: Result,
        entity_name: String,
    }

    /// Removes an entity.
    DeleteEntityRequest = "simulation_interfaces/srv/DeleteEntity_Request" {
        entity: String,
    }

    /// How it went.
    DeleteEntityResponse = "simulation_interfaces/srv/DeleteEntity_Response" {
        result: Result,
    }

    /// Asks what can be done.
    GetSimulatorFeaturesRequest = "simulation_interfaces/srv/GetSimulatorFeatures_Request" {
    }

    /// It.
    GetSimulatorFeaturesResponse = "simulation_interfaces/srv/GetSimulatorFeatures_Response" {
        features: SimulatorFeatures,
    }
}

services! {
    /// Names of entities.
    GetEntities = "simulation_interfaces/srv/GetEntities" (GetEntitiesRequest, GetEntitiesResponse);
    /// Where an entity is.
    GetEntityState = "simulation_interfaces/srv/GetEntityState" (GetEntityStateRequest, GetEntityStateResponse);
    /// Moves an entity.
    SetEntityState = "simulation_interfaces/srv/SetEntityState" (SetEntityStateRequest, SetEntityStateResponse);
    /// Whether the simulation goes on.
    GetSimulationState = "simulation_interfaces/srv/GetSimulationState"
        (GetSimulationStateRequest, GetSimulationStateResponse);
    /// Makes it go on, or not.
    SetSimulationState = "simulation_interfaces/srv/SetSimulationState"
        (SetSimulationStateRequest, SetSimulationStateResponse);
    /// Goes back to the start.
    ResetSimulation = "simulation_interfaces/srv/ResetSimulation" (ResetSimulationRequest, ResetSimulationResponse);
    /// Takes steps.
    StepSimulation = "simulation_interfaces/srv/StepSimulation" (StepSimulationRequest, StepSimulationResponse);
    /// Makes an entity.
    SpawnEntity = "simulation_interfaces/srv/SpawnEntity" (SpawnEntityRequest, SpawnEntityResponse);
    /// Removes one.
    DeleteEntity = "simulation_interfaces/srv/DeleteEntity" (DeleteEntityRequest, DeleteEntityResponse);
    /// What can be done.
    GetSimulatorFeatures = "simulation_interfaces/srv/GetSimulatorFeatures"
        (GetSimulatorFeaturesRequest, GetSimulatorFeaturesResponse);
}
