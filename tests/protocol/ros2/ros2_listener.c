// A ROS 2 program as DDS sees one, in another vendor's DDS: reads one message of each topic and prints it as JSON.
//   ros2_listener DOMAIN ROBOT [map]     the robot's topics, or with `map` the fleet's map until a cloud has points
// Readers ask for what ROS' defaults ask for. Exit code 0 if all came within 30 s.
#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "ros2.h"

static dds_entity_t readerOf(dds_entity_t participant, const dds_topic_descriptor_t* type, const char* name,
                             bool latched) {
  const dds_data_representation_id_t representation = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qos_t* qos = dds_create_qos();
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(1));
  dds_qset_durability(qos, latched ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
  dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 10);
  dds_qset_data_representation(qos, 1, &representation);
  const dds_entity_t topic = dds_create_topic(participant, type, name, NULL, NULL);
  const dds_entity_t reader = topic < 0 ? topic : dds_create_reader(participant, topic, qos, NULL);
  dds_delete_qos(qos);
  return reader;
}

static void* await(dds_entity_t reader) {
  for (int i = 0; i < 6000; ++i) {
    void* samples[1] = {NULL};
    dds_sample_info_t info[1];
    if (dds_take(reader, samples, info, 1, 1) == 1 && info[0].valid_data) return samples[0];
    dds_sleepfor(DDS_MSECS(5));
  }
  return NULL;
}

static void printHeader(const std_msgs_msg_dds__Header_* header) {
  printf("\"stamp_ns\":%lld,\"frame\":\"%s\"", (long long)header->stamp.sec * 1000000000 + header->stamp.nanosec,
         header->frame_id);
}

static void printPose(const geometry_msgs_msg_dds__Vector3_* p, const geometry_msgs_msg_dds__Quaternion_* q) {
  printf("\"position\":[%.9g,%.9g,%.9g],\"rotation\":[%.9g,%.9g,%.9g,%.9g]", p->x, p->y, p->z, q->x, q->y, q->z, q->w);
}

static int printTransforms(dds_entity_t reader, const char* key, uint32_t least) {
  const tf2_msgs_msg_dds__TFMessage_* message;
  do {
    message = await(reader);
    if (message == NULL) return 5;
  } while (message->transforms._length < least);
  printf(",\"%s\":[", key);
  for (uint32_t i = 0; i < message->transforms._length; ++i) {
    const geometry_msgs_msg_dds__TransformStamped_* one = &message->transforms._buffer[i];
    printf("%s{", i == 0 ? "" : ",");
    printHeader(&one->header);
    printf(",\"child\":\"%s\",", one->child_frame_id);
    printPose(&one->transform.translation, &one->transform.rotation);
    printf("}");
  }
  printf("]");
  return 0;
}

static int readRobot(dds_entity_t participant, const char* robot, uint32_t least_transforms) {
  char name[128];
  snprintf(name, sizeof name, "rt/%s/odom", robot);
  const dds_entity_t odom = readerOf(participant, &nav_msgs_msg_dds__Odometry__desc, name, false);
  snprintf(name, sizeof name, "rt/%s/path", robot);
  const dds_entity_t path = readerOf(participant, &nav_msgs_msg_dds__Path__desc, name, true);
  snprintf(name, sizeof name, "rt/%s/tracking_state", robot);
  const dds_entity_t state = readerOf(participant, &std_msgs_msg_dds__String__desc, name, true);
  const dds_entity_t tf = readerOf(participant, &tf2_msgs_msg_dds__TFMessage__desc, "rt/tf", false);
  const dds_entity_t tf_static = readerOf(participant, &tf2_msgs_msg_dds__TFMessage__desc, "rt/tf_static", true);
  if (odom < 0 || path < 0 || state < 0 || tf < 0 || tf_static < 0) return 4;
  const nav_msgs_msg_dds__Odometry_* odometry = await(odom);
  if (odometry == NULL) return 6;
  printf("{\"odom\":{");
  printHeader(&odometry->header);
  printf(",\"child\":\"%s\",", odometry->child_frame_id);
  printPose(&odometry->pose.pose.position, &odometry->pose.pose.orientation);
  const geometry_msgs_msg_dds__Twist_* twist = &odometry->twist.twist;
  printf(",\"linear\":[%.9g,%.9g,%.9g],\"angular\":[%.9g,%.9g,%.9g]", twist->linear.x, twist->linear.y, twist->linear.z,
         twist->angular.x, twist->angular.y, twist->angular.z);
  double sum = 0;
  for (int i = 0; i < 36; ++i) sum += odometry->pose.covariance[i] + odometry->twist.covariance[i];
  printf(",\"covariance_sum\":%.9g}", sum);
  const nav_msgs_msg_dds__Path_* poses = await(path);
  if (poses == NULL) return 7;
  printf(",\"path\":{");
  printHeader(&poses->header);
  printf(",\"poses\":%u}", poses->poses._length);
  const std_msgs_msg_dds__String_* text = await(state);
  if (text == NULL) return 8;
  printf(",\"tracking_state\":\"%s\"", text->data);
  int failed = printTransforms(tf_static, "tf_static", 1);
  if (failed == 0) failed = printTransforms(tf, "tf", least_transforms);
  printf("}\n");
  return failed;
}

static int readMap(dds_entity_t participant) {
  const dds_entity_t reader = readerOf(participant, &sensor_msgs_msg_dds__PointCloud2__desc, "rt/fleet/map", true);
  if (reader < 0) return 4;
  const sensor_msgs_msg_dds__PointCloud2_* cloud;
  do {
    cloud = await(reader);
    if (cloud == NULL) return 6;
  } while (cloud->width == 0);
  float low[3] = {1e9f, 1e9f, 1e9f}, high[3] = {-1e9f, -1e9f, -1e9f};
  for (uint32_t i = 0; i < cloud->width; ++i)
    for (int k = 0; k < 3; ++k) {
      float value;
      memcpy(&value, cloud->data._buffer + i * cloud->point_step + cloud->fields._buffer[k].offset, 4);
      low[k] = value < low[k] ? value : low[k];
      high[k] = value > high[k] ? value : high[k];
    }
  const uint8_t* colour = cloud->data._buffer + cloud->fields._buffer[3].offset;
  printf("{");
  printHeader(&cloud->header);
  printf(
      ",\"height\":%u,\"width\":%u,\"step\":%u,\"row\":%u,\"bytes\":%u,\"fields\":\"%s %s %s %s\",\"dense\":%d,"
      "\"low\":[%g,%g,%g],\"high\":[%g,%g,%g],\"bgr\":[%u,%u,%u]}\n",
      cloud->height, cloud->width, cloud->point_step, cloud->row_step, cloud->data._length,
      cloud->fields._buffer[0].name, cloud->fields._buffer[1].name, cloud->fields._buffer[2].name,
      cloud->fields._buffer[3].name, cloud->is_dense, low[0], low[1], low[2], high[0], high[1], high[2], colour[0],
      colour[1], colour[2]);
  return 0;
}

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  const dds_entity_t participant = dds_create_participant((dds_domainid_t)atoi(argv[1]), NULL, NULL);
  if (participant < 0) return 3;
  const int result = argc > 3 && strcmp(argv[3], "map") == 0 ? readMap(participant)
                                                             : readRobot(participant, argv[2], argc > 3 ? 2 : 1);
  fflush(stdout);
  dds_delete(participant);
  return result;
}
