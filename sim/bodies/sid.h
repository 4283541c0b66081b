// Standard Input Data of a flexible body (SID_FEM files): reading, checking, converting, writing.
//
// A SidFile holds what a file says, block by block, in one normal form whatever dialect it was written in:
//   block names mdCM and J; J as 6 x 1 (11 22 33 12 13 23); first-order entries indexed (row, mode, column);
//   Gr and Ge interleaved, column nq (c - 1) + j for axis c and mode j.
// The layout found in the file is established by identities, not assumed, and said in SidFile::notes. Blocks the reader does not
// know are kept as text and written again. write_sid then read_sid gives the same SidFile, bit by bit.
//
// Sources: O. Wallrapp, Standardization of Flexible Body Modeling in Multibody System Codes, Part 1: Definition of Standard Input
// Data, Mech. Struct. Mach. 22 (1994); R. Schwertassek, O. Wallrapp, Dynamik flexibler Mehrkoerpersysteme, Vieweg 1999.
#pragma once

#include "sim/bodies/flexible_body.h"
#include "sim/bodies/further_shapes.h"

#include <filesystem>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace flexframe::sim {

// One entry of M(q) = M0 + sum_k M1(:, k, :) q_k. mode = 0: of M0; mode = k >= 1: of M1(:, k, :). row and column from 1.
struct SidEntry {
  int row = 0, mode = 0, column = 0;
  double value = 0.0;
  bool operator==(const SidEntry&) const = default;
};

// A matrix as Taylor series in the elastic coordinates, as written: only the entries given, so its memory follows the file's size.
struct SidTaylor {
  int order = 0, rows = 0, columns = 0, modes = 0, nonlinear = 0;  // order nrow ncol nq nqn
  int structure = 3;                                               // 0 zero, 1 diagonal, 2 symmetric, 3 full, 4 unit
  std::vector<SidEntry> entries;
  std::vector<std::string> higher;  // lines mn(...) of higher order, as text
  bool operator==(const SidTaylor&) const = default;
};

// A block nobody here knows: its lines from its name to its end.
struct SidText {
  std::vector<std::string> lines;
  bool operator==(const SidText&) const = default;
};

struct SidNode {
  std::string id;  // the FE model's node number, or a name
  std::string rframe = "body ref";
  std::optional<SidTaylor> origin, phi, psi, AP, sigma;
  std::vector<SidText> others;
  bool operator==(const SidNode&) const = default;
};

struct SidFile {
  std::string comment;  // text behind the colon of the first line
  std::string name;     // behind 'new modal ='
  double mass = 0.0;    // kg
  int nelastq = 0;
  std::vector<std::string> labels;         // nelastq texts, empty where none is given
  std::vector<std::string> refmod_others;  // further lines of refmod
  std::vector<SidNode> nodes;
  std::optional<SidTaylor> mdCM, J, Ct, Cr, Me, Gr, Ge, Oe, ksigma, Ke, De;
  std::vector<SidText> others;
  FurtherShapes further;  // behind the end of the part, where other programs do not read on; none: the file has none
  bool operator==(const SidFile&) const = default;
};

// What the reader found out beyond the data.
enum class SidLayout { interleaved, blocked, either };
struct SidReading {
  SidFile file;
  SidLayout Gr = SidLayout::either, Ge = SidLayout::either;
  // One sentence each. notes: what the file contradicts itself in, or holds and is not used. dialect: how it was read where files differ.
  std::vector<std::string> notes, dialect;
};

// Reads a SID file. Throws InputError "FILE:LINE: what was found, what is allowed". Memory stays a small multiple of the file's size.
SidReading read_sid(const std::filesystem::path& path);
SidReading read_sid_text(std::string_view text, const std::string& name);  // name: for messages

// Writes by way of a temporary file beside `path`, so nothing half-written is left under the name. Shortest decimal
// form of each double, so reading gives the same bits. Throws InputError if it cannot be written or a value is not finite.
void write_sid(const SidFile& sid, const std::filesystem::path& path);
std::string write_sid_text(const SidFile& sid);

// M0 and M1(:, k, :), k from 1, dense, with the structure applied (unit, symmetric). rows x columns.
MatX sid_m0(const SidTaylor& block);
MatX sid_m1(const SidTaylor& block, int mode);
// Sets the entries of a block from dense matrices; zeros are not stored.
SidTaylor make_sid_block(const MatX& m0, const std::vector<MatX>& m1, int modes, int structure = 3);

// How well an identity of SID.md holds: largest deviation over the largest magnitude of the terms compared.
struct SidCheck {
  std::string identity;
  double residual = 0.0;
};
// All identities that the data of the file can be held to.
std::vector<SidCheck> check_sid(const SidFile& sid);

// What a body needs and a file does not say: `all` a sentence each for every motion, `unturned` nodes that move but have no rotation.
struct SidLacks {
  std::vector<std::string> all = {}, unturned = {};
};

// The body of a file: every first-order term is used. Where a block is missing its content is taken from the identities
// (md1 from mdCM, Ct; Cr0 from Cr.M0, else Gr; Cr1 from Cr.M1, else Ge / 2; J1 from J.M1, else Oe.M0; psi from AP.M1). Node k is named
// "node[ID]". What no identity gives is zero, and stands in `lacks`. Throws InputError where data are missing, contradict each other, or
// would need more memory than the file can justify.
FlexibleBody to_flexible_body(const SidFile& sid, const std::string& name, std::vector<std::string>* notes = nullptr,
                              SidLacks* lacks = nullptr);

// The file of a body. Node "node[ID]" gets id ID, others their name. Gr and Ge are made from J1, Cr0 and Cr1.
SidFile from_flexible_body(const FlexibleBody& body, const std::string& comment);

}  // namespace flexframe::sim
