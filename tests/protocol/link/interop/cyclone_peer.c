// The other end of a link, in another vendor's DDS (Eclipse Cyclone), from what docs/wire.md says alone.
//   cyclone_peer read  DOMAIN SITE          takes one keyframe of robot "a", writes its payload to stdout
//   cyclone_peer write DOMAIN SITE BYTES    is robot "b": writes one keyframe of that many bytes, waits for its ack
// Exit code 0 if that went well within 20 s, else the step that failed.
#include <dds/dds.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "octets.h"

static dds_qos_t* qosOf(const char* site, const char* robot, dds_durability_kind_t durability, bool latest) {
  static char own[128];
  snprintf(own, sizeof own, "%s/%s", site, robot);
  const char* partitions[] = {own};
  const dds_data_representation_id_t representation = DDS_DATA_REPRESENTATION_XCDR1;
  dds_qos_t* qos = dds_create_qos();
  dds_qset_partition(qos, 1, partitions);
  dds_qset_reliability(qos, DDS_RELIABILITY_RELIABLE, DDS_SECS(10));
  dds_qset_durability(qos, durability);
  dds_qset_history(qos, latest ? DDS_HISTORY_KEEP_LAST : DDS_HISTORY_KEEP_ALL, 1);
  dds_qset_data_representation(qos, 1, &representation);
  return qos;
}

static dds_entity_t topicOf(dds_entity_t participant, const char* name) {
  return dds_create_topic(participant, &comap_v1_Octets_desc, name, NULL, NULL);
}

// Waits for a sample of `robot`; the caller does not give the loan back.
static comap_v1_Octets* await(dds_entity_t reader, const char* robot) {
  for (int i = 0; i < 4000; ++i) {
    void* samples[1] = {NULL};
    dds_sample_info_t info[1];
    if (dds_take(reader, samples, info, 1, 1) == 1 && info[0].valid_data) {
      comap_v1_Octets* octets = samples[0];
      if (strcmp(octets->robot, robot) == 0) return octets;
    }
    dds_sleepfor(DDS_MSECS(5));
  }
  return NULL;
}

static int readKeyframe(dds_entity_t participant, const char* site) {
  dds_qos_t* qos = qosOf(site, "a", DDS_DURABILITY_VOLATILE, false);
  const dds_entity_t reader = dds_create_reader(participant, topicOf(participant, "comap/v1/keyframe"), qos, NULL);
  dds_delete_qos(qos);
  if (reader < 0) return 4;
  const comap_v1_Octets* octets = await(reader, "a");
  if (octets == NULL) return 5;
  return fwrite(octets->payload._buffer, 1, octets->payload._length, stdout) == octets->payload._length ? 0 : 6;
}

static int writeKeyframe(dds_entity_t participant, const char* site, uint32_t size) {
  dds_qos_t* qos = qosOf(site, "b", DDS_DURABILITY_VOLATILE, false);
  const dds_entity_t writer = dds_create_writer(participant, topicOf(participant, "comap/v1/keyframe"), qos, NULL);
  dds_delete_qos(qos);
  qos = qosOf(site, "b", DDS_DURABILITY_TRANSIENT_LOCAL, true);
  const dds_entity_t reader = dds_create_reader(participant, topicOf(participant, "comap/v1/ack"), qos, NULL);
  dds_delete_qos(qos);
  if (writer < 0 || reader < 0) return 4;
  dds_publication_matched_status_t matched = {0};
  for (int i = 0; i < 4000 && matched.current_count == 0; ++i) {
    dds_get_publication_matched_status(writer, &matched);
    dds_sleepfor(DDS_MSECS(5));
  }
  if (matched.current_count == 0) return 5;
  comap_v1_Octets octets = {.robot = "b"};
  octets.payload._buffer = malloc(size);
  octets.payload._length = octets.payload._maximum = size;
  for (uint32_t i = 0; i < size; ++i) octets.payload._buffer[i] = (uint8_t)(i * 7 + i / 256);
  if (dds_write(writer, &octets) != DDS_RETCODE_OK) return 6;
  const comap_v1_Octets* ack = await(reader, "b");
  return ack == NULL ? 7 : ack->payload._length == 3 ? 0 : 8;
}

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  const dds_entity_t participant = dds_create_participant((dds_domainid_t)atoi(argv[2]), NULL, NULL);
  if (participant < 0) return 3;
  const int result = strcmp(argv[1], "read") == 0 ? readKeyframe(participant, argv[3])
                                                  : writeKeyframe(participant, argv[3], (uint32_t)atoi(argv[4]));
  dds_delete(participant);
  return result;
}
