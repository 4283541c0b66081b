// Places of a mechanism that moves in a plane at four times at once, for samples of a run that nobody asks how anything moves: their
// states are known, and none depends on another. The coordinates that close loops are found by the same iteration as closure.h's,
// the four in step.
#pragma once

#include "sim/dynamics/four_plane.h"

#include <memory>

namespace flexframe::sim {

struct FourClosing;  // how a cluster's loops are closed

class FourPlaces {
 public:
  // For the model's plane and the work of its system, which both stay where they are. frames: those that are asked for.
  FourPlaces(const Model& model, const Work& work, const PlaneMotion& plane, const std::vector<int>& frames);
  ~FourPlaces();
  FourPlaces(const FourPlaces&) = delete;
  FourPlaces& operator=(const FourPlaces&) = delete;

  // Whether four places can be found together at all: nothing but joints closes loops, and nothing bends as a rod with its whole axis.
  static bool fit(const Model& model, const PlaneMotion& plane, const std::vector<int>& frames);

  // states: 4 x size, rows whose first numbers are the model's coordinates. motions(lane): brings `work` to the expressions of that lane's
  // time, where joints follow motions. False where one of the four cannot be found this way, or conditions of loops that the partitions
  // leave out are open: then they are to be placed one by one, which tells more.
  template <class Motions>
  bool place(const Model& model, Work& work, const MatX& states, const Motions& motions) {
    take_coordinates(model, states);
    if (work_.carrying.driven)
      for (int lane = 0; lane < 4; ++lane) {
        motions(lane);
        take_motions(model, work, lane);
      }
    return place_clusters(model, work);
  }
  // Brings `to` to one of the four: all coordinates; poses of the frames asked for in their parts, and in the world those of the bodies
  // that these frames are on.
  void bring(const Model& model, int lane, Work& to) const;

 private:
  void take_coordinates(const Model& model, const MatX& states);
  void take_motions(const Model& model, const Work& work, int lane);
  bool place_clusters(const Model& model, Work& work);

  FourWork work_;
  // Frames that move in parts and are asked for: all, and those that neither joints nor loops hold on to; parts that are asked for.
  struct Asked {
    int at;
    bool plain;  // its planar axes, and its part's, are the axes themselves
  };
  std::vector<Asked> frames_, parts_;
  std::vector<int> beside_;
  std::vector<std::unique_ptr<FourClosing>> closing_;  // per cluster
};

}  // namespace flexframe::sim
