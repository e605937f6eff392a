"""ROS 2 definitions that rosbags lacks: control_msgs 6.8.0 and simulation_interfaces 2.1.0, without their
comments."""

DEFINITIONS = {
    "simulation_interfaces/msg/Result": """
uint8 RESULT_FEATURE_UNSUPPORTED = 0
uint8 RESULT_OK = 1
uint8 RESULT_NOT_FOUND = 2
uint8 RESULT_INCORRECT_STATE = 3
uint8 RESULT_OPERATION_FAILED = 4
uint8 result
string error_message
""",
    "simulation_interfaces/msg/EntityCategory": """
uint8 CATEGORY_OBJECT = 0
uint8 CATEGORY_ROBOT = 1
uint8 CATEGORY_HUMAN = 2
uint8 CATEGORY_DYNAMIC_OBJECT = 4
uint8 CATEGORY_STATIC_OBJECT = 5
uint8 category
""",
    "simulation_interfaces/msg/TagsFilter": """
string[] tags
uint8 FILTER_MODE_ANY = 0
uint8 FILTER_MODE_ALL = 1
uint8 filter_mode
""",
    "simulation_interfaces/msg/Bounds": """
uint8 TYPE_EMPTY = 0
uint8 TYPE_BOX = 1
uint8 TYPE_CONVEX_HULL = 2
uint8 TYPE_SPHERE = 3
uint8 type
geometry_msgs/Vector3[] points
""",
    "simulation_interfaces/msg/EntityFilters": """
string filter
EntityCategory[] categories
TagsFilter tags
Bounds bounds
""",
    "simulation_interfaces/msg/EntityState": """
std_msgs/Header header
geometry_msgs/Pose pose
geometry_msgs/Twist twist
geometry_msgs/Accel acceleration
""",
    "simulation_interfaces/msg/Resource": """
string uri
string resource_string
""",
    "simulation_interfaces/msg/SimulationState": """
uint8 STATE_STOPPED = 0
uint8 STATE_PLAYING = 1
uint8 STATE_PAUSED = 2
uint8 STATE_QUITTING = 3
uint8 STATE_NO_WORLD = 4
uint8 STATE_LOADING_WORLD = 5
uint8 state
""",
    "simulation_interfaces/msg/SimulatorFeatures": """
uint8 SPAWNING = 0
uint8 DELETING = 1
uint8 NAMED_POSES = 2
uint8 POSE_BOUNDS = 3
uint8 ENTITY_TAGS = 4
uint8 ENTITY_BOUNDS = 5
uint8 ENTITY_BOUNDS_BOX = 6
uint8 ENTITY_BOUNDS_CONVEX = 7
uint8 ENTITY_CATEGORIES = 8
uint8 SPAWNING_RESOURCE_STRING = 9
uint8 ENTITY_STATE_GETTING = 10
uint8 ENTITY_STATE_SETTING = 11
uint8 ENTITY_INFO_GETTING = 12
uint8 ENTITY_INFO_SETTING = 13
uint8 SPAWNABLES = 14
uint8 SIMULATION_RESET = 20
uint8 SIMULATION_RESET_TIME = 21
uint8 SIMULATION_RESET_STATE = 22
uint8 SIMULATION_RESET_SPAWNED = 23
uint8 SIMULATION_STATE_GETTING = 24
uint8 SIMULATION_STATE_SETTING = 25
uint8 SIMULATION_STATE_PAUSE = 26
uint8 STEP_SIMULATION_SINGLE = 31
uint8 STEP_SIMULATION_MULTIPLE = 32
uint8 STEP_SIMULATION_ACTION = 33
uint8 WORLD_LOADING = 40
uint8 WORLD_RESOURCE_STRING = 41
uint8 WORLD_TAGS = 42
uint8 WORLD_UNLOADING = 43
uint8 WORLD_INFO_GETTING = 44
uint8 AVAILABLE_WORLDS = 45
uint8 SPAWNING_ENTITIES = 50
uint16[] features
string[] spawn_formats
string custom_info
""",
    "simulation_interfaces/srv/GetEntities_Request": """
EntityFilters filters
""",
    "simulation_interfaces/srv/GetEntities_Response": """
Result result
string[] entities
""",
    "simulation_interfaces/srv/GetEntityState_Request": """
string entity
""",
    "simulation_interfaces/srv/GetEntityState_Response": """
Result result
EntityState state
""",
    "simulation_interfaces/srv/SetEntityState_Request": """
string entity
EntityState state
bool set_pose
bool set_twist
bool set_acceleration
""",
    "simulation_interfaces/srv/SetEntityState_Response": """
uint8 INVALID_POSE = 101
Result result
""",
    "simulation_interfaces/srv/GetSimulationState_Request": """

""",
    "simulation_interfaces/srv/GetSimulationState_Response": """
SimulationState state
Result result
""",
    "simulation_interfaces/srv/SetSimulationState_Request": """
SimulationState state
""",
    "simulation_interfaces/srv/SetSimulationState_Response": """
uint8 ALREADY_IN_TARGET_STATE = 101
uint8 STATE_TRANSITION_ERROR = 102
uint8 INCORRECT_TRANSITION = 103
Result result
""",
    "simulation_interfaces/srv/ResetSimulation_Request": """
uint8 SCOPE_DEFAULT = 0
uint8 SCOPE_TIME = 1
uint8 SCOPE_STATE = 2
uint8 SCOPE_SPAWNED = 4
uint8 SCOPE_ALL = 255
uint8 scope
""",
    "simulation_interfaces/srv/ResetSimulation_Response": """
Result result
""",
    "simulation_interfaces/srv/StepSimulation_Request": """
uint64 steps 1
""",
    "simulation_interfaces/srv/StepSimulation_Response": """
Result result
""",
    "simulation_interfaces/srv/SpawnEntity_Request": """
string name
bool allow_renaming
Resource entity_resource
string entity_namespace
geometry_msgs/PoseStamped initial_pose
""",
    "simulation_interfaces/srv/SpawnEntity_Response": """
uint8 NAME_NOT_UNIQUE = 101
uint8 NAME_INVALID = 102
uint8 UNSUPPORTED_FORMAT = 103
uint8 NO_RESOURCE = 104
uint8 NAMESPACE_INVALID = 105
uint8 RESOURCE_PARSE_ERROR = 106
uint8 MISSING_ASSETS = 107
uint8 UNSUPPORTED_ASSETS = 108
uint8 INVALID_POSE = 109
Result result
string entity_name
""",
    "simulation_interfaces/srv/DeleteEntity_Request": """
string entity
""",
    "simulation_interfaces/srv/DeleteEntity_Response": """
Result result
""",
    "simulation_interfaces/srv/GetSimulatorFeatures_Request": """

""",
    "simulation_interfaces/srv/GetSimulatorFeatures_Response": """
SimulatorFeatures features
""",
    "control_msgs/msg/JointTolerance": """
string name
float64 position
float64 velocity
float64 acceleration
""",
    "control_msgs/msg/JointComponentTolerance": """
uint16 X_AXIS=1
uint16 Y_AXIS=2
uint16 Z_AXIS=3
uint16 TRANSLATION=4
uint16 ROTATION=5
string joint_name
uint16 component
float64 position
float64 velocity
float64 acceleration
""",
    "control_msgs/action/FollowJointTrajectory_Goal": """
trajectory_msgs/JointTrajectory trajectory
trajectory_msgs/MultiDOFJointTrajectory multi_dof_trajectory
JointTolerance[] path_tolerance
JointComponentTolerance[] component_path_tolerance
JointTolerance[] goal_tolerance
JointComponentTolerance[] component_goal_tolerance
builtin_interfaces/Duration goal_time_tolerance
""",
    "control_msgs/action/FollowJointTrajectory_Result": """
int32 error_code
int32 SUCCESSFUL = 0
int32 INVALID_GOAL = -1
int32 INVALID_JOINTS = -2
int32 OLD_HEADER_TIMESTAMP = -3
int32 PATH_TOLERANCE_VIOLATED = -4
int32 GOAL_TOLERANCE_VIOLATED = -5
string error_string
""",
    "control_msgs/action/FollowJointTrajectory_Feedback": """
std_msgs/Header header
string[] joint_names
trajectory_msgs/JointTrajectoryPoint desired
trajectory_msgs/JointTrajectoryPoint actual
trajectory_msgs/JointTrajectoryPoint error
int32 index
string[] multi_dof_joint_names
trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_desired
trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_actual
trajectory_msgs/MultiDOFJointTrajectoryPoint multi_dof_error
int32 multi_dof_index
""",
}
