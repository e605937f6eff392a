//! The interface of ROS 2 to simulators, version 2.

use super::geometry_msgs::{Accel, Pose, PoseStamped, Twist, Vector3};
use super::std_msgs::Header;
use crate::message::{messages, services};

messages! {
    /// Result of a call. Services have their own codes above 100.
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

    /// Category of an entity.
    EntityCategory = "simulation_interfaces/msg/EntityCategory" consts {
        CATEGORY_OBJECT: u8 = 0;
        CATEGORY_ROBOT: u8 = 1;
        CATEGORY_HUMAN: u8 = 2;
        CATEGORY_DYNAMIC_OBJECT: u8 = 4;
        CATEGORY_STATIC_OBJECT: u8 = 5;
    } {
        category: u8,
    }

    /// Filter by tags.
    TagsFilter = "simulation_interfaces/msg/TagsFilter" consts {
        FILTER_MODE_ANY: u8 = 0;
        FILTER_MODE_ALL: u8 = 1;
    } {
        tags: Vec<String>,
        filter_mode: u8,
    }

    /// A region of space.
    Bounds = "simulation_interfaces/msg/Bounds" consts {
        TYPE_EMPTY: u8 = 0;
        TYPE_BOX: u8 = 1;
        TYPE_CONVEX_HULL: u8 = 2;
        TYPE_SPHERE: u8 = 3;
    } {
        r#type: u8,
        points: Vec<Vector3>,
    }

    /// Filter for entities.
    EntityFilters = "simulation_interfaces/msg/EntityFilters" {
        filter: String,
        categories: Vec<EntityCategory>,
        tags: TagsFilter,
        bounds: Bounds,
    }

    /// Pose, twist and acceleration of an entity.
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

    /// State of the simulation.
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

    /// Features of a simulator.
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

    /// Requests the names of entities.
    GetEntitiesRequest = "simulation_interfaces/srv/GetEntities_Request" {
        filters: EntityFilters,
    }

    /// Names of entities.
    GetEntitiesResponse = "simulation_interfaces/srv/GetEntities_Response" {
        result: Result,
        entities: Vec<String>,
    }

    /// Requests an entity's state.
    GetEntityStateRequest = "simulation_interfaces/srv/GetEntityState_Request" {
        entity: String,
    }

    /// State of an entity.
    GetEntityStateResponse = "simulation_interfaces/srv/GetEntityState_Response" {
        result: Result,
        state: EntityState,
    }

    /// Sets an entity's state.
    SetEntityStateRequest = "simulation_interfaces/srv/SetEntityState_Request" {
        entity: String,
        state: EntityState,
        set_pose: bool,
        set_twist: bool,
        set_acceleration: bool,
    }

    /// Result of setting a state.
    SetEntityStateResponse = "simulation_interfaces/srv/SetEntityState_Response" consts {
        INVALID_POSE: u8 = 101;
    } {
        result: Result,
    }

    /// Requests the state of the simulation.
    GetSimulationStateRequest = "simulation_interfaces/srv/GetSimulationState_Request" {
    }

    /// State of the simulation.
    GetSimulationStateResponse = "simulation_interfaces/srv/GetSimulationState_Response" {
        state: SimulationState,
        result: Result,
    }

    /// Plays, pauses or stops the simulation.
    SetSimulationStateRequest = "simulation_interfaces/srv/SetSimulationState_Request" {
        state: SimulationState,
    }

    /// Result of changing the state.
    SetSimulationStateResponse = "simulation_interfaces/srv/SetSimulationState_Response" consts {
        ALREADY_IN_TARGET_STATE: u8 = 101;
        STATE_TRANSITION_ERROR: u8 = 102;
        INCORRECT_TRANSITION: u8 = 103;
    } {
        result: Result,
    }

    /// Resets the simulation.
    ResetSimulationRequest = "simulation_interfaces/srv/ResetSimulation_Request" consts {
        SCOPE_DEFAULT: u8 = 0;
        SCOPE_TIME: u8 = 1;
        SCOPE_STATE: u8 = 2;
        SCOPE_SPAWNED: u8 = 4;
        SCOPE_ALL: u8 = 255;
    } {
        scope: u8,
    }

    /// Result of a reset.
    ResetSimulationResponse = "simulation_interfaces/srv/ResetSimulation_Response" {
        result: Result,
    }

    /// Steps a paused simulation.
    StepSimulationRequest = "simulation_interfaces/srv/StepSimulation_Request" {
        steps: u64,
    }

    /// Result of the steps.
    StepSimulationResponse = "simulation_interfaces/srv/StepSimulation_Response" {
        result: Result,
    }

    /// Spawns an entity.
    SpawnEntityRequest = "simulation_interfaces/srv/SpawnEntity_Request" {
        name: String,
        allow_renaming: bool,
        entity_resource: Resource,
        entity_namespace: String,
        initial_pose: PoseStamped,
    }

    /// Name of the new entity.
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

    /// Deletes an entity.
    DeleteEntityRequest = "simulation_interfaces/srv/DeleteEntity_Request" {
        entity: String,
    }

    /// Result of a deletion.
    DeleteEntityResponse = "simulation_interfaces/srv/DeleteEntity_Response" {
        result: Result,
    }

    /// Requests the features of the simulator.
    GetSimulatorFeaturesRequest = "simulation_interfaces/srv/GetSimulatorFeatures_Request" {
    }

    /// Features of the simulator.
    GetSimulatorFeaturesResponse = "simulation_interfaces/srv/GetSimulatorFeatures_Response" {
        features: SimulatorFeatures,
    }
}

services! {
    /// Returns the names of entities.
    GetEntities = "simulation_interfaces/srv/GetEntities" (GetEntitiesRequest, GetEntitiesResponse);
    /// Returns an entity's state.
    GetEntityState = "simulation_interfaces/srv/GetEntityState" (GetEntityStateRequest, GetEntityStateResponse);
    /// Sets an entity's state.
    SetEntityState = "simulation_interfaces/srv/SetEntityState" (SetEntityStateRequest, SetEntityStateResponse);
    /// Returns the state of the simulation.
    GetSimulationState = "simulation_interfaces/srv/GetSimulationState"
        (GetSimulationStateRequest, GetSimulationStateResponse);
    /// Plays, pauses or stops the simulation.
    SetSimulationState = "simulation_interfaces/srv/SetSimulationState"
        (SetSimulationStateRequest, SetSimulationStateResponse);
    /// Resets the simulation.
    ResetSimulation = "simulation_interfaces/srv/ResetSimulation" (ResetSimulationRequest, ResetSimulationResponse);
    /// Steps the simulation.
    StepSimulation = "simulation_interfaces/srv/StepSimulation" (StepSimulationRequest, StepSimulationResponse);
    /// Spawns an entity.
    SpawnEntity = "simulation_interfaces/srv/SpawnEntity" (SpawnEntityRequest, SpawnEntityResponse);
    /// Deletes an entity.
    DeleteEntity = "simulation_interfaces/srv/DeleteEntity" (DeleteEntityRequest, DeleteEntityResponse);
    /// Returns the features of the simulator.
    GetSimulatorFeatures = "simulation_interfaces/srv/GetSimulatorFeatures"
        (GetSimulatorFeaturesRequest, GetSimulatorFeaturesResponse);
}
