#pragma once
#include <hooke/types.hpp>
