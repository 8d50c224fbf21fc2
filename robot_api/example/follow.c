/* Prints each pose of the robot as it comes: follow SOCKET [COUNT]. Ends after COUNT poses, or when the agent does.
 * If the agent was killed, which leaves its socket behind, or does not answer, that is told, and the exit code is 3.
 * A line: sequence, stamp in ns, tracking, state in the map, name of the map (- if none), then T_map_cam_exact and
 * T_odom_cam, each as x y z qx qy qz qw. */
#include <comap_robot.h>
#include <inttypes.h>
#include <stdio.h>
#include <stdlib.h>
#include <unistd.h>

static void print_transform(const comap_robot_transform *t) {
  printf(" %.17g %.17g %.17g %.17g %.17g %.17g %.17g", t->x, t->y, t->z, t->qx, t->qy, t->qz, t->qw);
}

int main(int argc, char **argv) {
  if (argc < 2) {
    fprintf(stderr, "usage: follow SOCKET [COUNT]\n");
    return 2;
  }
  const long most = argc > 2 ? strtol(argv[2], NULL, 10) : 0;
  comap_robot *robot = comap_robot_new();
  if (robot == NULL) return 3;
  if (comap_robot_connect(robot, argv[1], 5000) != COMAP_ROBOT_OK) {
    fprintf(stderr, "follow: %s\n", comap_robot_error(robot));
    comap_robot_free(robot);
    return 3;
  }
  fprintf(stderr, "follow: robot %s\n", comap_robot_name(robot));
  comap_robot_pose pose = {0};
  pose.size = sizeof pose;
  int result = COMAP_ROBOT_OK;
  for (long i = 0; (most == 0 || i < most) && result >= COMAP_ROBOT_OK;) {
    result = comap_robot_wait_pose(robot, &pose, 1000);
    if (result != COMAP_ROBOT_OK) continue; /* nothing new within a second, or an error */
    printf("%" PRIu64 " %" PRId64 " %d %d %s", pose.sequence, pose.stamp_ns, (int)pose.tracking, (int)pose.map_state,
           pose.map[0] != '\0' ? pose.map : "-");
    print_transform(&pose.T_map_cam_exact);
    print_transform(&pose.T_odom_cam);
    printf("\n");
    fflush(stdout); /* as they come, into a pipe too */
    ++i;
  }
  const int ended = result == COMAP_ROBOT_UNREACHABLE && access(argv[1], F_OK) != 0;
  if (result < COMAP_ROBOT_OK) fprintf(stderr, "follow: %s\n", comap_robot_error(robot));
  if (result == COMAP_ROBOT_UNREACHABLE && !ended)
    fprintf(stderr, "follow: its socket is still there: it was killed, hangs, or has been started again\n");
  comap_robot_free(robot);
  return result == COMAP_ROBOT_OK || result == COMAP_ROBOT_NOTHING || ended ? 0 : 3;
}
