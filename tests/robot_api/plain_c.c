/* The header as a C program sees it. */
#include "robot_api/comap_robot.h"

int c_sees_pose_size(void);
int c_sees_pose_size(void) { return (int)sizeof(comap_robot_pose); }
