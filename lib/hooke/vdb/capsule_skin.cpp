#include <hooke/vdb/capsule_skin.hpp>
