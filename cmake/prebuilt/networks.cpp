#include <npt/transfer/pose_transfer.hpp>

template const std::vector<npt::NetworkType<npt::DefaultExecutor>>&
npt::network_types<npt::AllNetworks, npt::DefaultExecutor>();
template class npt::NetworkTransfer<npt::DefaultExecutor>;
template class npt::BasicPoseTransfer<npt::DefaultExecutor>;
