// What draws the samples of trainings, out of the commands, which are compiled at -O1: there it took 40 % of a reader's
// training and 28 % of a rig's.
#include <npt/body/natural_poses.hpp>
#include <npt/body/people_plan.hpp>
#include <npt/lab/body_sampler.hpp>
#include <npt/lab/family_sampler.hpp>
#include <npt/lab/rig/rig_sampler.hpp>
#include <training/animal_variation.hpp>
#include <training/correspondence_sampler.hpp>
#include <training/people_variation.hpp>

#include <memory>
#include <string>
#include <utility>
#include <vector>

namespace npt::compiled {

/// Never called: making one of each is what has their members compiled here.
std::vector<std::unique_ptr<SampleSource>> samplers(const std::vector<WeightedBody>& bodies,
                                                    std::vector<WeightedCloud> clouds,
                                                    std::shared_ptr<const Family> family,
                                                    std::shared_ptr<const RigMixture> rigs,
                                                    const std::vector<std::string>& held_out) {
  std::vector<std::unique_ptr<SampleSource>> all;
  all.push_back(std::make_unique<BodySampler>(bodies));
  all.push_back(std::make_unique<FamilySampler>(std::move(family), held_out));
  all.push_back(std::make_unique<CorrespondenceSampler>(
      clouds, std::make_shared<const PeopleVariation>([](Random& random) { return natural_poses().sample(random); }),
      CorrespondenceSampleOptions{}));
  all.push_back(std::make_unique<CorrespondenceSampler>(
      std::move(clouds),
      std::make_shared<const AnimalVariation>(people_plan(), TemplateReach{},
                                              [](Random&) { return std::vector<float>(); }),
      CorrespondenceSampleOptions{}));
  all.push_back(std::make_unique<RigSampler>(std::move(rigs)));
  return all;
}

}  // namespace npt::compiled
