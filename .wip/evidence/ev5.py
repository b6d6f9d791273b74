from ev4 import *
class Case5(Case4):
    """registration and wall shared by all trials; nuisances of heavy tails"""
    NU=3.0; SHARED_SD=2.0; OWN=0.3
    def __init__(s,path,**k):
        super().__init__(path,**k)
        names=[n['name'] for n in s.h['nuisances']]
        s.shared=[i for i,n in enumerate(names) if n.startswith('registration') or n.startswith('wall') or 'junction' in n or n.startswith('tilt')]
        s.names=names
    def prepare(s,c,a,kappa,tau=1.2):
        nch=len(s.h['channels']); nb=2*s.K; W=[]
        for t,tr in enumerate(s.h['trials']):
            S=(c['s'][t] if c['s'] else tr['s']); J=c['jacobian'][t]; w=tr['weight'][:,None]
            B=s.basis(tr); sh=(c['raw'][t]-s.nom['raw'][t])/tr['weight']
            base=np.column_stack([c['raw'][t],S,J])/w if J.size else np.column_stack([c['raw'][t],S])/w
            X=np.zeros((base.shape[0],base.shape[1]+nch*nb)); ld=0
            for ch,idx in enumerate(s.idx[t]):
                if len(idx)==0: continue
                m=tr['model'][idx]; n=s.n[t][ch]; open2=m*m+(0.3*n)**2
                p=np.sqrt(a*a*open2+kappa**2*sh[idx]**2); tt=tr['t'][idx]
                n2=np.full(len(idx),n**2)*s.rmin2[t][idx]
                Kv=np.exp(-np.abs(tt[:,None]-tt[None,:])/tau)*np.outer(p,p); Kv[np.diag_indices(len(idx))]+=n2
                L=cholesky(Kv,lower=True)
                M=np.column_stack([base[idx],B[idx]*p[:,None]])
                Y=solve_triangular(L,M,lower=True)
                nbx=base.shape[1]
                X[idx,:nbx]=Y[:,:nbx]; X[idx,nbx+ch*nb:nbx+(ch+1)*nb]=Y[:,nbx:]
                ld+=2*np.log(np.diag(L)).sum()
            ms=S.shape[1]; W.append((X[:,0],X[:,1:1+ms],X[:,1+ms:],ld))
        return W
    def score(s,c,a=1,kappa=0.2,b=1,tau=1.2,kc=None,per=False):
        W=s.prepare(c,a,kappa,tau)
        nch=len(s.h['channels']); nb=2*s.K; k0=len(c['coordinates']); sh=s.shared; ns=len(sh)
        m=W[0][1].shape[1]
        sc=np.concatenate([[x['scale'] for x in c['coordinates']],np.ones(nch*nb),np.full(ns,s.SHARED_SD)])
        dv=np.concatenate([[x['value']-x['off'] for x in c['coordinates']],np.zeros(nch*nb+ns)])
        L0=np.diag(1/sc**2)
        own=np.ones(m); own[sh]=s.OWN
        N=[];g=[];q=[];ld=[]
        for (r,S,J,l) in W:
            J=np.column_stack([J,S[:,sh]])
            v=own**2; pen=0
            # heavy tails: a few rounds of scale mixture, with the shared part left free
            SS=S.T@S; Sr=S.T@r
            for it in range(3):
                A=np.diag(1/v)+SS; z=-solve(A,Sr); zz=(z/own)**2
                v=own**2*np.maximum(1.0,(s.NU+zz)/(s.NU+1))
            lam=v/own**2
            pen=(np.log(lam)*s.NU+s.NU*(1/lam-1)).sum()  # -2 ln p(v) of inverse gamma, relative to lam=1
            Sv=S*np.sqrt(v)[None,:]
            A=np.eye(m)+Sv.T@Sv; Ai=inv(A); Sr=Sv.T@r
            q.append(r@r-Sr@Ai@Sr); ld.append(l+slogdet(A)[1]+max(pen,0)+np.log(lam).sum())
            SJ=Sv.T@J; N.append(J.T@J-SJ.T@Ai@SJ); g.append(J.T@r-SJ.T@Ai@Sr)
        Na=sum(N)+L0; ga=sum(g)+L0@dv; P=[]
        for t in range(s.T):
            P1=Na-N[t]; gg=ga-g[t]; dl=-solve(P1,gg)
            q1=q[t]+2*g[t]@dl+dl@N[t]@dl; bb=g[t]+N[t]@dl
            Q=q1-bb@solve(P1+N[t],bb)
            P.append(-0.5*(Q+ld[t]+slogdet(P1+N[t])[1]-slogdet(P1)[1]))
        return P if per else sum(P)
