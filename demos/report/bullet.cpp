#include "rivals.hpp"

#ifdef HOOKE_REPORT_WITH_BULLET

#include <BulletSoftBody/btSoftBody.h>
#include <BulletSoftBody/btSoftBodyRigidBodyCollisionConfiguration.h>
#include <BulletSoftBody/btSoftRigidDynamicsWorld.h>
#include <btBulletDynamicsCommon.h>

#include <cmath>

namespace hooke::report {

namespace {

btVector3 vector(const Points<double>& p, Index i) { return {btScalar(p(i, 0)), btScalar(p(i, 1)), btScalar(p(i, 2))}; }

// A world with one soft body, as Bullet's own examples make it: links with a stiffness in [0, 1], relative to the
// stiffest spring; position iterations; no damping.
class BulletSheet {
 public:
  BulletSheet(const PlainSprings& scene, int iterations) : world_(&dispatcher_, &broadphase_, &solver_, &settings_) {
    const btVector3 gravity(btScalar(scene.gravity.x()), btScalar(scene.gravity.y()), btScalar(scene.gravity.z()));
    world_.setGravity(gravity);
    world_.getWorldInfo().m_gravity = gravity;
    btAlignedObjectArray<btVector3> x;
    btAlignedObjectArray<btScalar> masses;
    for (Index i = 0; i < scene.positions.rows(); ++i) {
      x.push_back(vector(scene.positions, i));
      masses.push_back(scene.held[std::size_t(i)] ? btScalar(0) : btScalar(scene.masses[i]));
    }
    body_ = new btSoftBody(&world_.getWorldInfo(), x.size(), &x[0], &masses[0]);
    double stiffest = 0;
    for (const auto& spring : scene.springs) stiffest = std::max(stiffest, spring.stiffness);
    std::vector<std::pair<double, btSoftBody::Material*>> materials;
    for (const auto& spring : scene.springs) {
      btSoftBody::Material* material = nullptr;
      for (const auto& [stiffness, known] : materials)
        if (stiffness == spring.stiffness) material = known;
      if (!material) {
        material = body_->appendMaterial();
        material->m_kLST = btScalar(spring.stiffness / stiffest);
        materials.emplace_back(spring.stiffness, material);
      }
      body_->appendLink(spring.a, spring.b, material);
    }
    for (Index i = 0; i < scene.velocities.rows(); ++i) body_->m_nodes[int(i)].m_v = vector(scene.velocities, i);
    body_->m_cfg.piterations = iterations;
    body_->setActivationState(DISABLE_DEACTIVATION);
    world_.addSoftBody(body_);
  }
  ~BulletSheet() {
    world_.removeSoftBody(body_);
    delete body_;
  }
  BulletSheet(const BulletSheet&) = delete;
  BulletSheet& operator=(const BulletSheet&) = delete;

  void run(int steps, double duration) {
    for (int i = 0; i < steps; ++i) world_.stepSimulation(btScalar(duration / steps), 0);
  }
  Points<double> positions() const {
    Points<double> out(body_->m_nodes.size(), 3);
    for (int i = 0; i < body_->m_nodes.size(); ++i)
      for (int k = 0; k < 3; ++k) out(i, k) = double(body_->m_nodes[i].m_x[k]);
    return out;
  }

 private:
  btSoftBodyRigidBodyCollisionConfiguration settings_;
  btCollisionDispatcher dispatcher_{&settings_};
  btDbvtBroadphase broadphase_;
  btSequentialImpulseConstraintSolver solver_;
  btSoftRigidDynamicsWorld world_;
  btSoftBody* body_ = nullptr;
};

}  // namespace

std::vector<Series> bullet_classic(const PlainSprings& scene) {
  std::vector<Series> out;
  if (scene.triangles.empty()) return out;  // sheets only
  for (const int iterations : {1, 2, 5, 20}) {
    Series series;
    series.name = "bullet-classic with piterations = " + std::to_string(iterations);
    series.levels = 8;
    series.run = [scene, iterations](int level, int, double) {
      const int steps = int(std::lround(scene.duration * 60)) << level;
      BulletSheet sheet(scene, iterations);
      Outcome outcome;
      const double begin = cpu_seconds();
      sheet.run(steps, scene.duration);
      outcome.cpu = cpu_seconds() - begin;
      outcome.positions = sheet.positions();
      outcome.row.method = "bullet-classic";
      outcome.row.precision = sizeof(btScalar) == sizeof(float) ? "float" : "double";
      outcome.row.setting = std::to_string(iterations) + (iterations == 1 ? " iteration" : " iterations");
      outcome.row.dt = scene.duration / steps;
      outcome.row.evaluations = outcome.row.energy_drift = outcome.row.momentum_drift = std::nan("");
      return outcome;
    };
    out.push_back(std::move(series));
  }
  return out;
}

std::string bullet_version() {
  return std::to_string(btGetVersion() / 100) + "." + std::to_string(btGetVersion() % 100);
}

}  // namespace hooke::report

#else

namespace hooke::report {

std::vector<Series> bullet_classic(const PlainSprings&) { return {}; }
std::string bullet_version() { return {}; }

}  // namespace hooke::report

#endif
