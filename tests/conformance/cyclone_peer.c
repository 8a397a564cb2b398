/* A peer that knows nothing of our code: C, Cyclone DDS, types generated from gatefield.idl by Cyclone's own compiler.
 * It takes one sample of each type of the vehicle "ours", checks what it understands of it, and sends it back as the
 * vehicle "cyclone". Ends with 0 when it has done so for all seven types, with 1 when a value is wrong or 20 s are over.
 *   gatefield-cyclone-peer <domain>
 */
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#include "dds/dds.h"
#include "gatefield.h"

#define TYPES 7

static int wrong = 0;

#define EXPECT(condition)                                \
  do {                                                   \
    if (!(condition)) {                                  \
      printf("line %d: not %s\n", __LINE__, #condition); \
      wrong = 1;                                         \
    }                                                    \
  } while (0)

static void check_health(const gatefield_wire_PlannerHealth* h) {
  EXPECT(h->effective_samples == 123.5);
  EXPECT(h->lowest_field_m == -0.125);
  EXPECT(h->target_waypoint == 2 && h->lap == 1);
  EXPECT(!h->course_done && h->degraded);
  EXPECT(h->problems == (1ull << 9 | 1ull << 17));
}

static void check_request(const void* sample) {
  const gatefield_wire_SessionRequest* r = sample;
  EXPECT(r->version == gatefield_wire_PROTOCOL_VERSION);
  EXPECT(r->request == 7 && r->action == 0 && r->timing == 1);
  EXPECT(strcmp(r->profile, "race") == 0);
  EXPECT(r->priority == 7);
  EXPECT(r->quadrotor.mass_kg == 0.83);
  EXPECT(r->quadrotor.rotor_position_B_m[1][0] == -0.0771 && r->quadrotor.rotor_position_B_m[1][1] == 0.0771);
  EXPECT(r->quadrotor.rotor_spin[0] == 1 && r->quadrotor.rotor_spin[3] == -1);
  EXPECT(r->quadrotor.collision_radius_m == 0.13 && r->quadrotor.body_rate_max_rad_s[2] == 6);
  EXPECT(r->actuation.kind == 0 && r->actuation.rate_time_constant_s[0] == 0);
  EXPECT(r->camera.width_px == 160 && r->camera.height_px == 90 && r->camera.rate_hz == 60);
  EXPECT(r->camera.metres_per_count == 0.0005 && r->camera.distortion_model == 1 && r->camera.distortion[4] == 5e-6);
  EXPECT(r->course.waypoints._length == 3);
  EXPECT(r->course.waypoints._length == 3 && r->course.waypoints._buffer[1].p_W[2] == 1.25);
  if (r->course.waypoints._length == 3) {
    EXPECT(r->course.waypoints._buffer[1].gate_opening == 1 && r->course.waypoints._buffer[1].gate_outer_half_m == 0.8);
    EXPECT(r->course.waypoints._buffer[2].gate_id == 5);
  }
  EXPECT(r->course.laps == 3 && r->course.closed && r->course.floor_known && r->course.floor_z_m == -0.25);
}

static void check_reply(const void* sample) {
  const gatefield_wire_SessionReply* r = sample;
  EXPECT(r->accepted && r->reason[0] == '\0' && strcmp(r->server, "planner-1") == 0);
  EXPECT(r->session == 0x1122334455667788ull && r->model_hash == 0xfedcba9876543210ull);
  EXPECT(r->control_period_s == 0.02 && r->plan_steps == 20);
  EXPECT(r->code == 0 && r->field[0] == '\0');
  EXPECT(r->retry_after_s == 1.5 && r->heir[0] == 1 && r->heir[11] == 12);
}

static void check_state(const void* sample) {
  const gatefield_wire_VehicleState* s = sample;
  EXPECT(s->sequence_number == 1 && s->stamp_ns == 1234567890123ll);
  EXPECT(s->p_WB[0] == 1.5 && s->p_WB[1] == -2.25 && s->p_WB[2] == 3.125);
  EXPECT(s->q_WB[1] == -0.5 && s->q_WB[3] == 0.5);
  EXPECT(s->thrust_command_n[3] == 2.875 && !s->thrust_known);
  EXPECT(s->round_trip_ns == 4200000 && s->depth_sequence == 5 && s->heard_waypoint == 2 && s->heard_lap == 1);
  EXPECT(s->asked_by == 2 && s->asked_collective_thrust_n == 8.25f && s->asked_body_rates_rad_s[2] == 1.25f);
}

static void check_depth(const void* sample) {
  const gatefield_wire_DepthFrame* f = sample;
  EXPECT(f->width_px == 160 && f->height_px == 90 && f->encoding == 0);
  EXPECT(f->pixels._length == 2 * 160 * 90);
  for (uint32_t i = 0; i < f->pixels._length; ++i)
    if (f->pixels._buffer[i] != (uint8_t)(i * 7 + 1)) {
      printf("pixel byte %u is %u\n", i, f->pixels._buffer[i]);
      wrong = 1;
      return;
    }
}

static void check_command(const void* sample) {
  const gatefield_wire_ThrustRateCommand* c = sample;
  EXPECT(c->answers_sequence == 9 && c->answers_stamp_ns == 1234567890123ll);
  EXPECT(c->plan_step_ns == 30000000 && c->validity_ns == 600000000);
  EXPECT(c->plan._length == 20);
  if (c->plan._length == 20) {
    EXPECT(c->plan._buffer[19].thrust_rate_n_s[1] == -4.75f);
    EXPECT(c->plan._buffer[19].rotor_thrust_n[3] == 8.25f);
    EXPECT(c->plan._buffer[19].collective_thrust_n == 30.0f);
    EXPECT(c->plan._buffer[19].body_rates_rad_s[2] == 0.5f);
  }
  check_health(&c->health);
  EXPECT(strcmp(c->isa, "avx2") == 0);
}

static void check_telemetry(const void* sample) {
  const gatefield_wire_Telemetry* t = sample;
  EXPECT(t->server_stamp_ns == 99000000001ll);
  check_health(&t->health);
  EXPECT(t->states_received == 1001 && t->deadlines_missed == 6 && t->encode_time_s == 0.00375);
  EXPECT(t->found_thrust_factor == 1.0625 && t->found_rate_time_constant_s[2] == 0.0625);
  EXPECT(t->found_rate_limit_rad_s[0] == 0.0 && t->found_rate_limit_rad_s[1] == 2.5);
  EXPECT(t->last_code == 1 && strcmp(t->last_field, "q_WB") == 0 && strcmp(t->last_expected, "norm 1") == 0);
  EXPECT(strcmp(t->last_reason, "q_WB has norm 2, expected 1") == 0);
}

static void check_status(const void* sample) {
  const gatefield_wire_ServerStatus* s = sample;
  EXPECT(s->version == gatefield_wire_PROTOCOL_VERSION);
  EXPECT(s->room_cores == 1.25 && s->sessions == 3 && s->accepts);
  EXPECT(strcmp(s->isa, "avx2") == 0 && s->model_hash == 0xfedcba9876543210ull);
}

/* The QoS of docs/wire.md, said again by someone else. */
typedef struct {
  const char* topic;
  const dds_topic_descriptor_t* descriptor;
  size_t vehicle_offset; /* the vehicle's or server's name: where the key stands in the sample */
  bool reliable, transient_local, exclusive;
  void (*check)(const void* sample);
} Kind;

static const Kind kinds[TYPES] = {
    {"gatefield/session/request", &gatefield_wire_SessionRequest_desc, offsetof(gatefield_wire_SessionRequest, vehicle),
     true, true, false, check_request},
    {"gatefield/session/reply", &gatefield_wire_SessionReply_desc, offsetof(gatefield_wire_SessionReply, vehicle), true,
     true, false, check_reply},
    {"gatefield/vehicle/state", &gatefield_wire_VehicleState_desc, offsetof(gatefield_wire_VehicleState, vehicle),
     false, false, false, check_state},
    {"gatefield/vehicle/depth", &gatefield_wire_DepthFrame_desc, offsetof(gatefield_wire_DepthFrame, vehicle), true,
     false, false, check_depth},
    {"gatefield/vehicle/command", &gatefield_wire_ThrustRateCommand_desc,
     offsetof(gatefield_wire_ThrustRateCommand, vehicle), true, false, true, check_command},
    {"gatefield/telemetry", &gatefield_wire_Telemetry_desc, offsetof(gatefield_wire_Telemetry, vehicle), false, false,
     false, check_telemetry},
    {"gatefield/server/status", &gatefield_wire_ServerStatus_desc, offsetof(gatefield_wire_ServerStatus, name), false,
     false, false, check_status},
};

static dds_entity_t must(dds_entity_t entity, const char* what) {
  if (entity < 0) {
    printf("%s: %s\n", what, dds_strretcode(-entity));
    exit(1);
  }
  return entity;
}

int main(int argc, char** argv) {
  const dds_domainid_t domain = argc > 1 ? (dds_domainid_t)atoi(argv[1]) : 0;
  const dds_entity_t participant = must(dds_create_participant(domain, NULL, NULL), "participant");
  dds_entity_t readers[TYPES], writers[TYPES];
  for (int i = 0; i < TYPES; ++i) {
    const Kind* kind = &kinds[i];
    dds_qos_t* qos = dds_create_qos();
    dds_qset_reliability(qos, kind->reliable ? DDS_RELIABILITY_RELIABLE : DDS_RELIABILITY_BEST_EFFORT, DDS_MSECS(100));
    dds_qset_durability(qos, kind->transient_local ? DDS_DURABILITY_TRANSIENT_LOCAL : DDS_DURABILITY_VOLATILE);
    dds_qset_history(qos, DDS_HISTORY_KEEP_LAST, 1);
    dds_qset_ignorelocal(qos, DDS_IGNORELOCAL_PARTICIPANT); /* its own echoes */
    if (kind->exclusive) {
      dds_qset_ownership(qos, DDS_OWNERSHIP_EXCLUSIVE);
      dds_qset_deadline(qos, DDS_MSECS(50));
      dds_qset_liveliness(qos, DDS_LIVELINESS_MANUAL_BY_TOPIC, DDS_MSECS(100));
    }
    const dds_entity_t topic =
        must(dds_create_topic(participant, kind->descriptor, kind->topic, NULL, NULL), kind->topic);
    if (kind->exclusive) dds_qset_partition1(qos, "gatefield/ours");
    readers[i] = must(dds_create_reader(participant, topic, qos, NULL), kind->topic);
    if (kind->exclusive) dds_qset_partition1(qos, "gatefield/cyclone");
    writers[i] = must(dds_create_writer(participant, topic, qos, NULL), kind->topic);
    dds_delete_qos(qos);
  }

  bool heard[TYPES] = {false};
  void* kept[TYPES] = {NULL}; /* what to send back, again and again: best-effort samples may be lost */
  const dds_time_t end = dds_time() + DDS_SECS(20);
  int left = TYPES;
  while (dds_time() < end) {
    for (int i = 0; i < TYPES; ++i) {
      void* sample = NULL;
      dds_sample_info_t info;
      while (!heard[i] && dds_take(readers[i], &sample, &info, 1, 1) == 1) {
        char* vehicle = (char*)sample + kinds[i].vehicle_offset;
        if (info.valid_data && strcmp(vehicle, "ours") == 0) {
          kinds[i].check(sample);
          printf("heard %s\n", kinds[i].topic);
          fflush(stdout);
          strcpy(vehicle, "cyclone");
          kept[i] = sample; /* stays on loan to the end */
          heard[i] = true;
          --left;
        } else {
          dds_return_loan(readers[i], &sample, 1);
          sample = NULL;
        }
      }
      if (heard[i] && dds_write(writers[i], kept[i]) != DDS_RETCODE_OK) {
        printf("writing %s failed\n", kinds[i].topic);
        wrong = 1;
      }
    }
    if (wrong) break;
    dds_sleepfor(DDS_MSECS(20));
    /* Our side closes its input when it has heard everything. What was never matched is not closed: what it says may be
     * here before the readers that answer it have found each other. */
    if (left == 0) {
      dds_publication_matched_status_t status;
      if (dds_get_publication_matched_status(writers[0], &status) == DDS_RETCODE_OK && status.total_count > 0 &&
          status.current_count == 0)
        break;
    }
  }
  for (int i = 0; i < TYPES; ++i)
    if (!heard[i]) printf("never heard %s\n", kinds[i].topic);
  dds_delete(participant);
  return wrong || left > 0;
}
