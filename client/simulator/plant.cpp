#include "client/simulator/plant.h"

#include <mujoco/mujoco.h>

#include <array>
#include <cmath>
#include <cstring>
#include <mutex>
#include <sstream>
#include <vector>

namespace gatefield::simulator {
namespace {

constexpr const char* kFileName = "world.xml";

void write_pose(const Eigen::Isometry3d& X_WO, std::ostream& out) {
  const Eigen::Vector3d p = X_WO.translation();
  const Eigen::Quaterniond q(X_WO.linear());
  out << " pos=\"" << p.x() << ' ' << p.y() << ' ' << p.z() << "\" quat=\"" << q.w() << ' ' << q.x() << ' ' << q.y()
      << ' ' << q.z() << "\"";
}

/// The world in MuJoCo's language. `meaning` says what each geom is, in the order of their ids; the vehicle has the
/// last one.
std::string describe(const scene::World& world, const QuadrotorModel& model, std::vector<Contact>* meaning) {
  std::ostringstream out;
  out.precision(17);
  out << R"(<mujoco model="gatefield"><option timestep=")" << seconds(Plant::kStep)
      << R"(" integrator="RK4" gravity="0 0 )" << -kGravity_m_s2 << "\"/><worldbody>";
  const auto add_box = [&](const scene::Box& box, Contact contact) {
    out << R"(<geom type="box" size=")" << box.half_m.x() << ' ' << box.half_m.y() << ' ' << box.half_m.z() << "\"";
    write_pose(box.X_WO, out);
    out << "/>";
    meaning->push_back(contact);
  };
  for (std::size_t i = 0; i < world.gates.size(); ++i)
    for (const auto& box : scene::frame_boxes(world.gates[i]))
      add_box(box, {Contact::With::kGate, static_cast<int>(i)});
  for (std::size_t i = 0; i < world.boxes.size(); ++i)
    add_box(world.boxes[i], {Contact::With::kClutter, static_cast<int>(i)});
  if (world.has_floor) {
    out << R"(<geom type="plane" size="0 0 1" pos="0 0 )" << world.floor_z_m << "\"/>";
    meaning->push_back({Contact::With::kFloor, 0});
  }
  const Eigen::Vector3d& J = model.inertia_kg_m2;
  out << R"(<body name="vehicle"><freejoint/><inertial pos="0 0 0" mass=")" << model.mass_kg << R"(" diaginertia=")"
      << J.x() << ' ' << J.y() << ' ' << J.z() << R"("/><geom type="sphere" size=")" << model.collision_radius_m
      << "\"/></body></worldbody></mujoco>";
  return out.str();
}

}  // namespace

struct Plant::Physics {
  struct ModelDeleter {
    void operator()(mjModel* model) const { mj_deleteModel(model); }
  };
  struct DataDeleter {
    void operator()(mjData* data) const { mj_deleteData(data); }
  };
  std::unique_ptr<mjModel, ModelDeleter> model;
  std::unique_ptr<mjData, DataDeleter> data;
  std::vector<Contact> meaning;  ///< by geom id
  int body = 1;
};

Result<std::unique_ptr<Plant>> Plant::create(const scene::World& world, const QuadrotorModel& model,
                                             const Eigen::Vector3d& wind_W_m_s,
                                             const std::optional<Aerodynamics>& air) {
  static std::once_flag quiet;
  // MuJoCo would write its warnings to a file in the working folder; what matters of them, the referee sees in the
  // state.
  std::call_once(quiet, [] { mju_user_warning = [](const char*) {}; });

  auto physics = std::make_unique<Physics>();
  const std::string xml = describe(world, model, &physics->meaning);
  const auto files = std::make_unique<mjVFS>();
  mj_defaultVFS(files.get());
  if (mj_makeEmptyFileVFS(files.get(), kFileName, static_cast<int>(xml.size())) != 0)
    return Error{"MuJoCo takes no world of " + std::to_string(xml.size()) +
                 " bytes, expected fewer gates and obstacles"};
  std::memcpy(files->filedata[mj_findFileVFS(files.get(), kFileName)], xml.data(), xml.size());
  std::array<char, 1000> reason{};
  physics->model.reset(mj_loadXML(kFileName, files.get(), reason.data(), static_cast<int>(reason.size())));
  mj_deleteVFS(files.get());
  if (!physics->model) return Error{"MuJoCo refuses the world: " + std::string(reason.data())};
  physics->data.reset(mj_makeData(physics->model.get()));
  if (!physics->data) return Error{"MuJoCo found no memory for the world's state"};
  physics->body = mj_name2id(physics->model.get(), mjOBJ_BODY, "vehicle");
  return std::unique_ptr<Plant>(new Plant(std::move(physics), model, wind_W_m_s, air));
}

Plant::Plant(std::unique_ptr<Physics> physics, const QuadrotorModel& model, const Eigen::Vector3d& wind_W_m_s,
             const std::optional<Aerodynamics>& air)
    : physics_(std::move(physics)), model_(model), wind_W_m_s_(wind_W_m_s), air_(air) {
  state_.thrust_n = state_.thrust_command_n = hover_thrust_n(model_);
  set_state(state_);
}

Plant::~Plant() = default;

void Plant::set_state(const QuadrotorState& state) noexcept {
  state_ = state;
  mjData* data = physics_->data.get();
  Eigen::Map<Eigen::Vector3d>(data->qpos) = state.p_WB;
  data->qpos[3] = state.q_WB.w();
  data->qpos[4] = state.q_WB.x();
  data->qpos[5] = state.q_WB.y();
  data->qpos[6] = state.q_WB.z();
  Eigen::Map<Eigen::Vector3d>(data->qvel) = state.v_WB;
  // Of a free joint: angular velocity in the body's own axes.
  Eigen::Map<Eigen::Vector3d>(data->qvel + 3) = state.w_WB_B;
  mj_forward(physics_->model.get(), data);
  read_back();
}

void Plant::step(const ThrustRates& u) noexcept {
  QuadrotorState rotors = state_;
  step_rotors(model_, u, seconds(kStep), &rotors);
  step_body(rotors);
}

void Plant::step_held(const PlainVector4& thrust_command_n) noexcept {
  QuadrotorState rotors = state_;
  rotors.thrust_command_n = thrust_command_n.cwiseMax(model_.thrust_min_n).cwiseMin(model_.thrust_max_n);
  const double decay = std::exp(-seconds(kStep) / model_.rotor_time_constant_s);
  rotors.thrust_n = rotors.thrust_command_n + decay * (state_.thrust_n - rotors.thrust_command_n);
  step_body(rotors);
}

PlainVector4 Plant::hover_setting_n() const noexcept {
  PlainVector4 setting_n = gatefield::hover_thrust_n(model_);
  if (air_)
    for (double& one_n : setting_n) one_n = air_->setting_n(one_n);
  return setting_n;
}

Wrench Plant::wrench(const QuadrotorState& state) const noexcept {
  if (!air_) return aerodynamic_wrench(model_, state, wind_W_m_s_);
  QuadrotorState given = state;
  given.thrust_n = air_->thrust_n(state, wind_W_m_s_);
  Wrench wrench = aerodynamic_wrench(model_, given, wind_W_m_s_);
  wrench.force_W += air_->drag_W(state, wind_W_m_s_);
  return wrench;
}

void Plant::step_body(const QuadrotorState& rotors) noexcept {
  const double dt_s = seconds(kStep);
  QuadrotorState middle = state_;
  middle.thrust_n = 0.5 * (state_.thrust_n + rotors.thrust_n);
  const Eigen::Vector3d a_W = wrench(middle).force_W / model_.mass_kg - Eigen::Vector3d(0, 0, kGravity_m_s2);
  middle.v_WB += 0.5 * dt_s * a_W;
  const Eigen::Vector3d half_angle_B = 0.25 * dt_s * state_.w_WB_B;  // half of the angle turned in half a step
  middle.q_WB =
      (state_.q_WB * Eigen::Quaterniond(1.0, half_angle_B.x(), half_angle_B.y(), half_angle_B.z())).normalized();
  const Wrench held = wrench(middle);

  mjData* data = physics_->data.get();
  // Force and torque at the centre of mass, both in world axes.
  mjtNum* applied = data->xfrc_applied + 6 * physics_->body;
  Eigen::Map<Eigen::Vector3d>{applied} = held.force_W;
  Eigen::Map<Eigen::Vector3d>(applied + 3) = middle.q_WB * held.torque_B;
  mj_step(physics_->model.get(), data);
  if (air_) air_->pass(middle.thrust_n, dt_s);

  time_ += kStep;
  state_.thrust_n = rotors.thrust_n;
  state_.thrust_command_n = rotors.thrust_command_n;
  read_back();
}

void Plant::read_back() noexcept {
  const mjData* data = physics_->data.get();
  state_.p_WB = Eigen::Map<const Eigen::Vector3d>(data->qpos);
  state_.q_WB = Eigen::Quaterniond(data->qpos[3], data->qpos[4], data->qpos[5], data->qpos[6]).normalized();
  state_.v_WB = Eigen::Map<const Eigen::Vector3d>(data->qvel);
  state_.w_WB_B = Eigen::Map<const Eigen::Vector3d>(data->qvel + 3);

  contact_.reset();
  double deepest_m = 0.0;
  const auto vehicle_geom = static_cast<int>(physics_->meaning.size());
  for (int i = 0; i < data->ncon; ++i) {
    const mjContact& touch = data->contact[i];
    const int other = touch.geom1 == vehicle_geom ? touch.geom2 : touch.geom1;
    if (other < vehicle_geom && touch.dist < deepest_m) {
      deepest_m = touch.dist;
      contact_ = physics_->meaning[static_cast<std::size_t>(other)];
    }
  }
}

}  // namespace gatefield::simulator
